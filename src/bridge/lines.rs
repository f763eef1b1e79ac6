//! Straight edges the way the 2022 paper finds them: Canny's edge detector and
//! the probabilistic Hough transform.

use nalgebra::Point2;
use opencv::core::{BORDER_DEFAULT, Mat, MatTraitConst, Rect, Size, Vec4i, Vector};
use opencv::imgproc::{canny, gaussian_blur, hough_lines_p};

use super::{BridgeError, during, grey8_mat, prepare};
use crate::frame::Frame;
use crate::geometry::{ImagePoint, Roi};

/// Settings of the edge detector and the line finder.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeSettings {
    /// Standard deviation of the Gaussian blur before the detector \[px\]; 0
    /// leaves the picture as it is.
    pub blur_sigma_px: f64,
    /// Canny's lower and upper threshold on the gradient, on a scale of 8-bit
    /// grey values with Sobel's 3x3 kernel.
    pub thresholds: [f64; 2],
    /// Votes that make a line.
    pub votes: u16,
    /// Shorter lines are dropped \[px\].
    pub shortest_px: f64,
    /// Longest gap that is bridged within a line \[px\].
    pub longest_gap_px: f64,
}

/// A straight piece of edge between two pixels of the image \[px\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    /// One end.
    pub from: ImagePoint,
    /// The other end.
    pub to: ImagePoint,
}

/// Straight edges within a region of the picture, in raw image pixels. No line
/// at all is an empty list; a region outside the picture is an error. The
/// answer depends only on the arguments.
pub fn canny_hough(
    frame: &Frame,
    roi: Roi,
    settings: &EdgeSettings,
) -> Result<Vec<Segment>, BridgeError> {
    const TASK: &str = "finding straight edges";
    prepare();
    if !roi.fits(frame.size()) || roi.width == 0 || roi.height == 0 {
        let (width, height) = frame.size();
        let what = format!("{roi:?} is not within a picture of {width}x{height} px");
        return Err(BridgeError { task: TASK, what });
    }
    let image = grey8_mat(frame)?;
    let lines = lines_within(&image, roi, settings).map_err(during(TASK))?;
    let (left, top) = (coordinate(roi.x), coordinate(roi.y));
    let end = |x: i32, y: i32| Point2::new(f64::from(left + x), f64::from(top + y));
    Ok(lines.iter().map(|l| Segment { from: end(l[0], l[1]), to: end(l[2], l[3]) }).collect())
}

fn lines_within(image: &Mat, roi: Roi, settings: &EdgeSettings) -> opencv::Result<Vector<Vec4i>> {
    let window = Rect::new(
        coordinate(roi.x),
        coordinate(roi.y),
        coordinate(roi.width),
        coordinate(roi.height),
    );
    // A copy: on a view the filters would look at pixels outside the region.
    let mut region = image.roi(window)?.try_clone()?;
    if settings.blur_sigma_px > 0.0 {
        let sharp = region;
        region = Mat::default();
        let sigma = settings.blur_sigma_px;
        gaussian_blur(&sharp, &mut region, Size::new(0, 0), sigma, sigma, BORDER_DEFAULT)?;
    }
    let mut edges = Mat::default();
    let [low, high] = settings.thresholds;
    canny(&region, &mut edges, low, high, 3, true)?;
    let mut lines = Vector::<Vec4i>::new();
    hough_lines_p(
        &edges,
        &mut lines,
        1.0,
        std::f64::consts::PI / 180.0,
        i32::from(settings.votes),
        settings.shortest_px,
        settings.longest_gap_px,
    )?;
    Ok(lines)
}

/// A pixel index as OpenCV counts; the region has been checked to lie within a
/// picture that OpenCV holds.
fn coordinate(px: usize) -> i32 {
    i32::try_from(px).unwrap_or(i32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Pixels;
    use crate::time::Stamp;

    const SETTINGS: EdgeSettings = EdgeSettings {
        blur_sigma_px: 1.0,
        thresholds: [50.0, 150.0],
        votes: 40,
        shortest_px: 40.0,
        longest_gap_px: 10.0,
    };

    /// Bright from column 60 to 139.
    fn bar() -> Frame {
        let row = (0..200).map(|x| if (60..140).contains(&x) { 200 } else { 30 });
        let pixels = row.cycle().take(200 * 120).collect();
        Frame::new(0, Stamp::START, (200, 120), Pixels::Grey8(pixels)).unwrap()
    }

    #[test]
    fn both_edges_of_a_bar_are_found_in_image_pixels() {
        let roi = Roi { x: 20, y: 10, width: 160, height: 100 };
        let lines = canny_hough(&bar(), roi, &SETTINGS).unwrap();
        for edge in [59.5, 139.5] {
            let near =
                |s: &&Segment| (s.from.x - edge).abs() <= 1.0 && (s.to.x - edge).abs() <= 1.0;
            let length =
                lines.iter().filter(near).map(|s| (s.to - s.from).norm()).fold(0.0, f64::max);
            assert!(length > 80.0, "edge at {edge}: {lines:?}");
        }
        assert_eq!(lines, canny_hough(&bar(), roi, &SETTINGS).unwrap());
    }

    #[test]
    fn an_even_picture_has_no_edges_and_a_region_outside_is_refused() {
        let even = Frame::new(0, Stamp::START, (50, 50), Pixels::Grey16(vec![900; 2500])).unwrap();
        let roi = Roi { x: 0, y: 0, width: 50, height: 50 };
        assert_eq!(canny_hough(&even, roi, &SETTINGS).unwrap(), vec![]);
        let outside = Roi { x: 10, ..roi };
        assert!(canny_hough(&even, outside, &SETTINGS).is_err());
    }
}
