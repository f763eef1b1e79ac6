//! How a simulated bead is imaged, and what disturbs the image.

/// Light, blur, noise and view of rendered frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImageModel {
    /// Columns and rows \[px\]; a calibration file's size goes before it.
    pub size_px: [u32; 2],
    /// Grey level of the bead, of 256; what is above 255 is saturated.
    pub bead_grey: f64,
    /// Grey level of the ground, of 256; what is above 255 is saturated.
    pub ground_grey: f64,
    /// Standard deviation of the lens' Gaussian blur \[px\].
    pub blur_px: f64,
    /// Standard deviation of the noise of a pixel \[grey levels of 256\].
    pub noise_grey: f64,
    /// Light at the brighter end of the image over light at the other.
    pub light_ratio: f64,
    /// Direction in which the light grows \[degrees\]: 0 to the right, 90
    /// downwards. `None`: evenly from the upper left to the lower right corner.
    pub light_deg: Option<f64>,
    /// Angle of the bead to the gauge's axis on the surface \[degrees\]; positive
    /// where its column grows with the row, or its row with the column.
    pub slant_deg: f64,
    /// Shift of the bead's middle from the gauge's middle, to the right in the
    /// direction of travel \[mm\].
    pub lateral_mm: f64,
    /// True height of the bead's top edges, where it differs from that of the cell file.
    pub true_surface_height_mm: Option<f64>,
    /// Path of the bead, where it is not straight.
    pub bend: Bend,
    /// Light that falls on one side.
    pub shading: EdgeShading,
    /// Specular spots on the bead.
    pub spots: Spots,
    /// Grains on the edges.
    pub grains: Grains,
    /// A shadow beside the bead.
    pub shadow: Shadow,
    /// An older bead beside it.
    pub neighbour: Neighbour,
    /// Motion while the shutter is open.
    pub motion: MotionBlur,
    /// Texture of all that is seen.
    pub texture: TexturePattern,
}

/// An edge of the bead, in the order of a gauge: of a horizontal bead, left is
/// the upper one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BeadSide {
    /// The left or upper edge.
    Left,
    /// The right or lower edge.
    Right,
    /// Each of the two.
    Both,
}

/// The path of the bead about the middle of the gauge. A curve goes before a
/// corner.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bend {
    /// Radius of the bead's middle line \[mm\], positive where the path curves
    /// to the right in the direction of travel; 0 is straight. Larger than
    /// half the bead.
    pub radius_mm: f64,
    /// Angle by which the path turns to the right at the middle of the gauge
    /// \[degrees\], half of it before and half of it after; up to ±90.
    pub corner_deg: f64,
}

/// Grey that changes with the distance from an edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeShading {
    /// Change of the bead for each pixel of depth inside the edge \[grey
    /// levels/px\].
    pub bead_grey_per_px: f64,
    /// Depth from which it is constant \[px\].
    pub bead_px: f64,
    /// Change of the ground for each pixel outside the edge \[grey levels/px\].
    pub ground_grey_per_px: f64,
    /// Distance from which it is constant \[px\].
    pub ground_px: f64,
    /// The edges.
    pub side: BeadSide,
}

/// Saturated discs on the bead, at random positions in each frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spots {
    /// Mean fraction of the bead's area that they cover.
    pub covered_fraction: f64,
    /// Diameter \[px\].
    pub size_px: f64,
}

/// Discs on the edges, at random positions in each frame: their centres lie
/// within a radius of the edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grains {
    /// Fraction of the rows on which a grain covers the edge, on either edge.
    pub rows_fraction: f64,
    /// Diameter \[px\].
    pub size_px: f64,
    /// Grey level, of 256.
    pub grey: f64,
}

/// A shadow, or a gleam beside a dark bead, that runs parallel to an edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shadow {
    /// From the bead's edge to the near edge of the shadow \[px\]; 0 is none.
    pub distance_px: f64,
    /// Width \[px\].
    pub width_px: f64,
    /// How much darker than the ground it is – brighter beside a dark bead –,
    /// relative to the bead's contrast; negative for the opposite.
    pub contrast_fraction: f64,
    /// The edges.
    pub side: BeadSide,
}

/// An older bead that runs parallel to an edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Neighbour {
    /// From the bead's edge to the older bead \[px\]; 0 is none.
    pub gap_px: f64,
    /// Width \[px\].
    pub width_px: f64,
    /// Its contrast relative to the bead's.
    pub contrast_fraction: f64,
    /// The edges.
    pub side: BeadSide,
}

/// Steady motion of all that is seen while the shutter is open.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionBlur {
    /// Length \[px\].
    pub length_px: f64,
    /// Direction against the gauge's axis \[degrees\], counted like the slant.
    pub direction_deg: f64,
}

/// A random pattern over the whole image, new in each frame. Its
/// autocorrelation at the distance r is exp(−(r/L)²).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TexturePattern {
    /// Standard deviation \[grey levels of 256\].
    pub sigma_grey: f64,
    /// Correlation length L \[px\].
    pub length_px: f64,
}

impl ImageModel {
    /// An image that nothing disturbs.
    pub const DEFAULT: Self = Self {
        size_px: [720, 540],
        bead_grey: 150.0,
        ground_grey: 70.0,
        blur_px: 1.5,
        noise_grey: 4.0,
        light_ratio: 1.3,
        light_deg: None,
        slant_deg: 0.0,
        lateral_mm: 0.0,
        true_surface_height_mm: None,
        bend: Bend { radius_mm: 0.0, corner_deg: 0.0 },
        shading: EdgeShading {
            bead_grey_per_px: 0.0,
            bead_px: 30.0,
            ground_grey_per_px: 0.0,
            ground_px: 30.0,
            side: BeadSide::Left,
        },
        spots: Spots { covered_fraction: 0.0, size_px: 4.0 },
        grains: Grains { rows_fraction: 0.0, size_px: 6.0, grey: 230.0 },
        shadow: Shadow {
            distance_px: 0.0,
            width_px: 20.0,
            contrast_fraction: 0.7,
            side: BeadSide::Left,
        },
        neighbour: Neighbour {
            gap_px: 0.0,
            width_px: 100.0,
            contrast_fraction: 0.6,
            side: BeadSide::Left,
        },
        motion: MotionBlur { length_px: 0.0, direction_deg: 0.0 },
        texture: TexturePattern { sigma_grey: 0.0, length_px: 4.0 },
    };
}

impl Default for ImageModel {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl BeadSide {
    /// Whether the left and the right edge are meant.
    pub fn edges(self) -> [bool; 2] {
        [self != Self::Right, self != Self::Left]
    }
}
