//! What lies where in a frame.

/// A bead and its surroundings. Lengths in pixels, brightness in grey levels of a
/// camera with gamma 1.
#[derive(Debug, Clone)]
pub struct DrawnScene {
    /// Columns and rows \[px\]; the bead runs along the columns.
    pub size: (usize, usize),
    /// Width of the bead before its edges are torn.
    pub width_px: f64,
    /// Brightness of the bead.
    pub bead_grey: f64,
    /// Brightness of the ground.
    pub ground_grey: f64,
    /// Largest distance of its axis from the image's centre.
    pub position_jitter_px: f64,
    /// Roughness of its edges.
    pub edges: Tear,
    /// Texture of beads, as the image shows it.
    pub texture: Patches,
    /// Pattern of the ground, as the image shows it.
    pub ground_texture: Patches,
    /// Grooves on either side.
    pub grooves: [Option<Groove>; 2],
    /// Holes within the bead, and bays in its edges.
    pub holes: Option<Holes>,
    /// Seams (dark), ribs and highlights (bright) within the bead.
    pub ribs: Vec<Rib>,
    /// Sideways motion while the shutter is open.
    pub motion_px: f64,
    /// Standard deviation of the lens's blur.
    pub blur_px: f64,
    /// Brightness in the middle over that in the corners.
    pub vignetting: f64,
    /// Exponent of the camera: 255·(light/255)^gamma.
    pub gamma: f64,
    /// Standard deviation of a pixel's noise.
    pub noise_grey: f64,
    /// Quality of the JPEG that the frame was.
    pub jpeg: Option<u8>,
}

/// Roughness of an edge and its correlation length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tear {
    /// Standard deviation of the edge about its mean position.
    pub roughness_px: f64,
    /// Correlation length: the autocorrelation is exp(−|d|/length).
    pub length_px: f64,
}

/// A random pattern with the autocorrelation exp(−(r/length)²).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Patches {
    /// Standard deviation.
    pub size_grey: f64,
    /// Correlation length.
    pub length_px: f64,
}

/// A groove beside the bead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Groove {
    /// Mean width.
    pub width_px: f64,
    /// Brightness.
    pub grey: f64,
    /// Whether another bead, instead of the ground, lies beyond it.
    pub neighbour: bool,
}

/// Holes of one size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Holes {
    /// Number of bays in each edge; the bead has twice as many holes.
    pub count: usize,
    /// Diameter.
    pub size_px: f64,
    /// Brightness.
    pub grey: f64,
}

/// A line along the bead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rib {
    /// Position of its centre, from the bead's axis.
    pub at_px: f64,
    /// Width.
    pub width_px: f64,
    /// Brightness relative to the bead's; negative for a seam.
    pub over_grey: f64,
}

impl Default for DrawnScene {
    /// The bead of `docs/src/reference/accuracy.md`: 332 px, 150 on 70, σ = 4, s = 1.5.
    fn default() -> Self {
        let none = Patches { size_grey: 0.0, length_px: 1.0 };
        Self {
            size: (640, 100),
            width_px: 332.0,
            position_jitter_px: 1.0,
            bead_grey: 150.0,
            ground_grey: 70.0,
            edges: Tear { roughness_px: 0.0, length_px: 10.0 },
            texture: none,
            ground_texture: none,
            grooves: [None; 2],
            holes: None,
            ribs: Vec::new(),
            motion_px: 0.0,
            blur_px: 1.5,
            vignetting: 1.0,
            gamma: 1.0,
            noise_grey: 4.0,
            jpeg: None,
        }
    }
}

impl DrawnScene {
    /// Step from the ground to the bead \[grey levels\].
    pub fn contrast(&self) -> f64 {
        self.bead_grey - self.ground_grey
    }
}
