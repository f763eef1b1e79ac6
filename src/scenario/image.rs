//! The image of a simulated bead, and its disturbances.

/// Light, blur, noise and view of rendered frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImageModel {
    /// Columns and rows \[px\]; a calibration with an image size overrides it.
    pub size_px: [u32; 2],
    /// Grey level of the bead on a scale of 256; above 255 the image is saturated.
    pub bead_grey: f64,
    /// Grey level of the ground on a scale of 256; above 255 the image is saturated.
    pub ground_grey: f64,
    /// Standard deviation of the lens' Gaussian blur \[px\].
    pub blur_px: f64,
    /// Standard deviation of a pixel's noise \[grey levels of 256\].
    pub noise_grey: f64,
    /// Light at the brighter end of the image over light at the darker end.
    pub light_ratio: f64,
    /// Direction of increasing light \[degrees\]: 0 to the right, 90 downwards. `None`: from the
    /// upper left to the lower right corner.
    pub light_deg: Option<f64>,
    /// Angle of the bead to the gauge's axis on the surface \[degrees\]; positive if its column
    /// grows with the row, or its row with the column.
    pub slant_deg: f64,
    /// Shift of the bead's middle from the gauge's middle, to the right in the
    /// direction of travel \[mm\].
    pub lateral_mm: f64,
    /// True height of the bead's top edges; `None` if it is that of the cell file.
    pub true_surface_height_mm: Option<f64>,
    /// Path of the bead, straight or bent.
    pub bend: Bend,
    /// Grey level that changes with the distance from an edge.
    pub shading: EdgeShading,
    /// Specular spots on the bead.
    pub spots: Spots,
    /// Grains on the edges.
    pub grains: Grains,
    /// A shadow beside the bead.
    pub shadow: Shadow,
    /// An older bead beside the bead.
    pub neighbour: Neighbour,
    /// Motion during exposure.
    pub motion: MotionBlur,
    /// Texture of the whole image.
    pub texture: TexturePattern,
}

/// An edge of the bead as the gauge names it: the left edge of a horizontal bead is the upper one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BeadSide {
    /// The left or upper edge.
    Left,
    /// The right or lower edge.
    Right,
    /// Both edges.
    Both,
}

/// The path of the bead about the middle of the gauge. A radius takes precedence over a corner.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bend {
    /// Radius of the bead's centre line \[mm\], positive if the path curves to the right in the
    /// direction of travel; 0 is straight. Larger than half the bead's width.
    pub radius_mm: f64,
    /// Angle by which the path turns to the right at the middle of the gauge \[degrees\], half of
    /// it before and half of it after; up to ±90.
    pub corner_deg: f64,
}

/// Grey level that changes with the distance from an edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeShading {
    /// Change of the bead's grey level per pixel of depth inside the edge \[grey levels/px\].
    pub bead_grey_per_px: f64,
    /// Depth from which the grey level is constant \[px\].
    pub bead_px: f64,
    /// Change of the ground's grey level per pixel outside the edge \[grey levels/px\].
    pub ground_grey_per_px: f64,
    /// Distance from which the grey level is constant \[px\].
    pub ground_px: f64,
    /// The edges that have it.
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

/// Discs on the edges, at random positions in each frame: their centres lie within one radius of
/// the edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grains {
    /// Fraction of the rows on which grains cover an edge, the same for both edges.
    pub rows_fraction: f64,
    /// Diameter \[px\].
    pub size_px: f64,
    /// Grey level on a scale of 256.
    pub grey: f64,
}

/// A shadow, or a gleam beside a dark bead, that runs parallel to an edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shadow {
    /// Distance from the bead's edge to the near side of the shadow \[px\]; 0 for no shadow.
    pub distance_px: f64,
    /// Width \[px\].
    pub width_px: f64,
    /// How much darker than the ground it is, relative to the bead's contrast (brighter beside a
    /// dark bead); negative for the opposite.
    pub contrast_fraction: f64,
    /// The edges that have it.
    pub side: BeadSide,
}

/// An older bead that runs parallel to an edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Neighbour {
    /// Distance from the bead's edge to the older bead \[px\]; 0 for no older bead.
    pub gap_px: f64,
    /// Width \[px\].
    pub width_px: f64,
    /// Its contrast relative to the bead's.
    pub contrast_fraction: f64,
    /// The edges that have it.
    pub side: BeadSide,
}

/// Motion of the whole image at constant speed during exposure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionBlur {
    /// Length of the motion \[px\].
    pub length_px: f64,
    /// Direction relative to the gauge's axis \[degrees\], with the sign of the slant.
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
    /// An image without disturbances.
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
    /// Whether the left and the right edge are included.
    pub fn edges(self) -> [bool; 2] {
        [self != Self::Right, self != Self::Left]
    }
}
