//! Why a frame was not measured. A poor image is data, not an error.

/// A reason for refusing a frame, with what was found and what was needed.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum Reject {
    /// No two edges that belong together run through the gauge.
    #[error("edges that belong together on {:.0} % of the caliper lines, {:.0} % are needed; a bead has to run through the whole gauge along bead_axis, with a width in width_range_mm and the polarity that is named", (.got * 100.0).abs(), .need * 100.0)]
    NoPair {
        /// Fraction of the caliper lines on which a pair was found.
        got: f64,
        /// Fraction that is needed.
        need: f64,
    },
    /// The bead hardly differs from its surroundings.
    #[error("contrast of {:.1} grey levels, {:.1} are needed; more light, or light from one side, raises it", .got, .need)]
    LowContrast {
        /// Grey levels between ground and bead, of 256.
        got: f64,
        /// Grey levels that are needed.
        need: f64,
    },
    /// Too many pixels are saturated for the edges to show.
    #[error("{:.0} % of the bead or the gauge is saturated, {:.0} % is bearable; a shorter exposure or less light helps", .got * 100.0, .limit * 100.0)]
    Saturated {
        /// Fraction of saturated pixels in the gauge.
        got: f64,
        /// Largest fraction that is accepted.
        limit: f64,
    },
    /// Too little of the bead's edges lies below the end of the camera's scale.
    #[error("{:.0} % of the step between ground and bead lies within the camera's scale; it tells too little of the edge's position, {:.0} % and more are needed; a shorter exposure or less light shows more of it", .visible * 100.0, .need * 100.0)]
    Blinded {
        /// Fraction of the step between ground and bead that can be seen.
        visible: f64,
        /// Fraction that is needed.
        need: f64,
    },
    /// A pair was found, but no bead of this cell is that wide.
    #[error("width of {:.2} mm, plausible are {} to {} mm; if that is the bead, width_range_mm has to contain it", .got_mm, .min_mm, .max_mm)]
    WidthOutOfRange {
        /// Width that was found \[mm\].
        got_mm: f64,
        /// Narrowest that is plausible \[mm\].
        min_mm: f64,
        /// Widest that is plausible \[mm\].
        max_mm: f64,
    },
    /// The edges do not run along the bead's axis to within 20 degrees, or the
    /// two do not agree.
    #[error("edges at {:.0} degrees to the gauge's axis, measured are up to {:.0}; turn the camera, or set bead_axis as the bead runs", .got_rad.to_degrees(), .limit_rad.to_degrees())]
    Crooked {
        /// Angle between the edges' run and the gauge's axis \[rad\].
        got_rad: f64,
        /// Largest angle that is measured \[rad\].
        limit_rad: f64,
    },
    /// The bead bends too sharply for a width normal to its axis: a corner.
    #[error("{}; edges may look bent, too, because they are rough, which a longer gauge evens out, or because the camera's gamma is not given", bend(*.got_widths, *.least_widths))]
    Corner {
        /// Radius of its axis, in its widths; 0 where it turns at once.
        got_widths: f64,
        /// Smallest radius that is measured, in widths.
        least_widths: f64,
    },
    /// The positions of an edge vary too much from line to line.
    #[error("the positions of an edge scatter by {:.2} px about each other, {:.2} are bearable: something lies on it, or it is the edge of no bead; a gauge that holds one bead and plain ground beside it helps", .got_px, .limit_px)]
    Scattered {
        /// Robust standard deviation of the positions \[px\].
        got_px: f64,
        /// Largest that is accepted \[px\].
        limit_px: f64,
    },
    /// The bead's edges are too uncertain: too much of them is occluded.
    #[error("so much of the edges is occluded that the standard deviation of the width is {:.2} px, the limit is {:.2}; the occluded rows have to be made visible", .got_px, .limit_px)]
    Occluded {
        /// Standard deviation of the width \[px\].
        got_px: f64,
        /// Largest that is accepted \[px\].
        limit_px: f64,
    },
    /// A width was found, but its standard deviation is too large a fraction of
    /// it.
    #[error("width of {width_mm:.2} mm with a standard deviation of {sigma_mm:.3} mm ({:.1} %), max_sigma is {:.3} mm ({:.1} %); {}", 100.0 * .sigma_mm / .width_mm, .max_sigma * .width_mm, 100.0 * .max_sigma, how_to_lower_sigma(*.edges_sigma_mm <= .max_sigma * .width_mm))]
    Unsure {
        /// Width that was found \[mm\].
        width_mm: f64,
        /// Its standard deviation \[mm\].
        sigma_mm: f64,
        /// Standard deviation without the calibration's uncertainty \[mm\].
        edges_sigma_mm: f64,
        /// Largest standard deviation, as a fraction of the width: the gauge's
        /// `max_sigma`.
        max_sigma: f64,
    },
    /// Edges that are blurred over so wide a flank that its shape matters.
    #[error("an edge is blurred by {:.1} px, measured are up to {:.1}; the lens may be out of focus, or the bead moves sideways while the shutter is open: a shorter exposure helps", .got_px, .limit_px)]
    Blurred {
        /// Standard deviation of the blur \[px\].
        got_px: f64,
        /// Largest that is measured \[px\].
        limit_px: f64,
    },
    /// A pattern beside the bead that is as strong as an edge.
    #[error("the ground beside the bead varies by {:.0} % of the contrast, {:.0} % is bearable; a plainer ground helps, or light that sets the bead off more from it", 100.0 * .got, 100.0 * .limit)]
    Patterned {
        /// Standard deviation of the pattern, as a fraction of the contrast.
        got: f64,
        /// Largest that is measured.
        limit: f64,
    },
    /// A bead that is not equally bright beside both edges and in its middle.
    #[error("what lies between the edges differs in brightness by {:.0} % of an edge's contrast, {:.0} % is bearable: one of the edges may not be the bead's; light from both sides, or a width range that is nearer to the bead, helps", 100.0 * .got, 100.0 * .limit)]
    Uneven {
        /// Difference of brightness, as a fraction of the fainter edge's contrast.
        got: f64,
        /// Largest that is measured.
        limit: f64,
    },
    /// Edges that hardly stand out from the bead's texture.
    #[error("no bead that stands out from the texture of the image: the likeliest edge is {:.1} times as strong as lines of texture, {:.1} are needed; check that a bead lies in roi_px along bead_axis, with this polarity and width_range_mm; if it does, light that makes both edges clear or a longer gauge helps", .got, .need)]
    Vague {
        /// Strength of the weaker edge, in typical steps of the texture.
        got: f64,
        /// Strength that is needed.
        need: f64,
    },
    /// Two pairs of edges fit equally well.
    #[error("two pairs of edges fit equally well, one {:.2} mm wide, the other {:.2} mm; a narrower width_range_mm, or a given polarity or edge, decides between them", .first_mm, .second_mm)]
    Ambiguous {
        /// Width of the one pair \[mm\].
        first_mm: f64,
        /// Width of the other \[mm\].
        second_mm: f64,
    },
    /// An edge lies so near the boundary of the gauge that it is cut short.
    #[error("an edge lies {:.1} px from the boundary of the gauge, {:.1} are needed; a gauge that is wider across the bead helps", .got_px, .need_px)]
    Clipped {
        /// Distance of the edge from the boundary \[px\].
        got_px: f64,
        /// Distance that is needed \[px\].
        need_px: f64,
    },
    /// The gauge does not lie within the image.
    #[error("the gauge does not fit an image of {}x{} px; roi_px has to lie within it", .image.0, .image.1)]
    WrongSize {
        /// Size of the image \[px\].
        image: (usize, usize),
    },
    /// The calibration was made with images of another size.
    #[error("the image has {}x{} px, the calibration was made with {}x{}; take images of that size, or calibrate again", .image.0, .image.1, .calibrated[0], .calibrated[1])]
    OtherSize {
        /// Size of the image \[px\].
        image: (usize, usize),
        /// Size of the images of the calibration \[px\].
        calibrated: [u32; 2],
    },
    /// The calibration has no point on the surface for an edge.
    #[error(
        "an edge has no point on the surface: the gauge reaches beyond the bed's horizon, or the calibration is that of another view"
    )]
    OffSurface,
    /// The frame has the pixels of those before it, although the robot has moved.
    #[error(
        "the frame is equal to those before it, and the robot has moved meanwhile; the camera, its driver or its network gives an old image again"
    )]
    Repeated,
    /// The frame could not be read at all.
    #[error("the frame could not be read")]
    Unreadable,
}

/// Nothing, or why a frame is refused.
pub type Checked = Result<(), Reject>;

impl Reject {
    /// The more informative of two reasons: why a frame has no rough edges, which is this
    /// one, and why it has no smooth ones.
    pub fn or(self, smooth: Self) -> Self {
        match (self, smooth) {
            (Self::NoPair { .. }, smooth) => smooth,
            // Two pairs of smooth edges are more than texture that an edge hardly exceeds.
            (Self::Vague { .. }, Self::Ambiguous { .. }) => smooth,
            (rough, _) => rough,
        }
    }

    /// The status that a frame gets in `widths.csv`.
    pub fn status(&self) -> &'static str {
        match self {
            Self::NoPair { .. } => "no_pair",
            Self::LowContrast { .. } => "low_contrast",
            Self::Saturated { .. } | Self::Blinded { .. } => "saturated",
            Self::WidthOutOfRange { .. } => "width_out_of_range",
            Self::Crooked { .. } => "crooked",
            Self::Corner { .. } => "corner",
            Self::Scattered { .. }
            | Self::Occluded { .. }
            | Self::Unsure { .. }
            | Self::Blurred { .. }
            | Self::Patterned { .. }
            | Self::Uneven { .. }
            | Self::Vague { .. } => "unsure",
            Self::Ambiguous { .. } => "ambiguous",
            Self::Clipped { .. } => "clipped",
            Self::WrongSize { .. } | Self::OtherSize { .. } => "wrong_size",
            Self::OffSurface => "off_surface",
            Self::Repeated => "repeated",
            Self::Unreadable => "unreadable",
        }
    }
}

/// What a bead does that bends too sharply; a radius of 0 is that of a corner.
fn bend(got_widths: f64, least_widths: f64) -> String {
    if got_widths <= 0.0 {
        format!(
            "the bead turns a corner within the gauge, measured are bends with a radius of {least_widths:.1} widths or more; a shorter gauge, or one where the bead runs straight, helps"
        )
    } else {
        format!(
            "the bead bends with a radius of {got_widths:.1} widths, measured are {least_widths:.1} or more; a shorter gauge, or one where the bead bends less, helps"
        )
    }
}

fn how_to_lower_sigma(edges_alone_are_sure: bool) -> &'static str {
    if edges_alone_are_sure {
        "the calibration's uncertainty takes it beyond the limit: calibrate again with more images"
    } else {
        "a longer gauge along the bead or a higher contrast lowers it"
    }
}
