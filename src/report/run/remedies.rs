//! Meaning and remedy of each reason for which a frame is rejected.

/// Meaning and remedy of a status in `widths.csv`.
pub fn of(status: &str) -> (&'static str, &'static str) {
    match status {
        "no_pair" => (
            "On too few lines across the gauge were two edges found that belong together.",
            "See that the bead runs through the gauge with ground on both sides; check roi_px, \
             bead_axis, polarity and width_range_mm.",
        ),
        "low_contrast" => (
            "The bead hardly differs in brightness from what is around it.",
            "Light from the side, or choose another channel; lower min_contrast_grey only if the \
             edges are seen well.",
        ),
        "saturated" => (
            "So much of the bead or the ground passes the end of the scale that too little of the edges \
             is seen.",
            "Shorten the exposure, dim the light or turn it away from the mirror direction.",
        ),
        "width_out_of_range" => (
            "Two edges were found, but no bead of this cell is that wide.",
            "Check the calibration and surface_height_mm; widen width_range_mm if such beads are \
             real.",
        ),
        "crooked" => (
            "The edges run askew by more than 20 degrees, or do not agree with each other.",
            "Turn the camera or the gauge with the bead; in sharp curves this is to be expected.",
        ),
        "clipped" => (
            "An edge lies so near the boundary of the gauge that it is clipped.",
            "Make roi_px larger across the bead, or bring the bead back to its middle.",
        ),
        "unsure" => (
            "The standard deviation of the width is more than max_sigma of it, too little of an \
             edge is seen, or no edge stands out from texture, from a pattern of the ground or \
             from blur.",
            "Check that a bead lies in the gauge. Make the gauge longer along the bead and raise the \
             contrast of the edges; remove what occludes them. The first message of this status \
             says whether the calibration's uncertainty is the larger part. Raise max_sigma only if such widths are good enough.",
        ),
        "ambiguous" => (
            "Two pairs of edges fit the bead equally well.",
            "Narrow width_range_mm so that only one of them is a possible width, or name the \
             polarity and the kind of edge.",
        ),
        "wrong_size" => (
            "The gauge does not lie within the image, or the calibration was made with images of \
             another size.",
            "Check the camera's resolution, and roi_px and the calibration's image_size_px against \
             the size of the images.",
        ),
        "off_surface" => (
            "By the calibration an edge does not lie on the measured surface.",
            "Calibrate again, or check surface_height_mm and the robot's z.",
        ),
        "corner" => (
            "The bead bends sharply within the gauge.",
            "Corners have no width normal to the bead; make the gauge shorter if gentle bends are refused.",
        ),
        "repeated" => (
            "The frame was equal to those before it in the gauge, although the robot had moved.",
            "See that the camera is triggered and runs on, and that nothing between camera and \
             program keeps an old image; restart the camera.",
        ),
        "unreadable" => (
            "The frame could not be decoded.",
            "Look at the file or the camera's cable; the log names each one.",
        ),
        _ => ("The frame was refused.", "See the log."),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vision::Reject;

    #[test]
    fn every_reason_is_explained() {
        let unknown = of("something else");
        for reject in [
            Reject::NoPair { got: 0.0, need: 0.5 },
            Reject::LowContrast { got: 0.0, need: 6.0 },
            Reject::Saturated { got: 0.5, limit: 0.1 },
            Reject::Blinded { visible: 0.2, need: 0.4 },
            Reject::WidthOutOfRange { got_mm: 1.0, min_mm: 2.0, max_mm: 3.0 },
            Reject::Crooked { got_rad: 1.0, limit_rad: 0.3 },
            Reject::Corner { got_widths: 0.5, least_widths: 1.5 },
            Reject::Scattered { got_px: 2.0, limit_px: 1.5 },
            Reject::Occluded { got_px: 0.4, limit_px: 0.2 },
            Reject::Unsure { width_mm: 9.0, sigma_mm: 0.9, edges_sigma_mm: 0.9, max_sigma: 0.02 },
            Reject::Ambiguous { first_mm: 9.0, second_mm: 12.0 },
            Reject::Clipped { got_px: 1.0, need_px: 3.0 },
            Reject::WrongSize { image: (1, 1) },
            Reject::OtherSize { image: (1, 1), calibrated: [2, 2] },
            Reject::OffSurface,
            Reject::Repeated,
            Reject::Unreadable,
        ] {
            assert_ne!(of(reject.status()), unknown, "{}", reject.status());
        }
    }
}
