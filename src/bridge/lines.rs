//! Straight edges by the method of the 2022 paper: Canny's edge detector and the probabilistic
//! Hough transform.

use nalgebra::Point2;
use opencv::core::{BORDER_DEFAULT, Mat, MatTraitConst, Rect, Size, ToInputArray, Vec4i, Vector};
use opencv::imgproc::{canny, gaussian_blur, hough_lines_p};

use super::{BridgeError, during, grey8_mat, prepare};
use crate::core::{Frame, ImagePoint, Pixels, Roi};

/// Settings of edge detector and Hough transform.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeSettings {
    /// Standard deviation of the Gaussian blur before the detector \[px\]; 0
    /// leaves the image as it is.
    pub blur_sigma_px: f64,
    /// Canny's lower and upper threshold on the gradient, on a scale of 8-bit
    /// grey values with Sobel's 3x3 kernel.
    pub thresholds: [f64; 2],
    /// Votes for a line.
    pub votes: u16,
    /// Shortest line \[px\].
    pub shortest_px: f64,
    /// Longest gap that is bridged within a line \[px\].
    pub longest_gap_px: f64,
}

/// A straight edge between two pixels \[px\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeSegment {
    /// One end.
    pub from: ImagePoint,
    /// The other end.
    pub to: ImagePoint,
}

/// Straight edges within a region of the image, in raw image pixels; empty without one. Fails
/// for a region outside the image. The result depends only on the arguments.
pub fn canny_hough(
    frame: &Frame,
    roi: Roi,
    settings: &EdgeSettings,
) -> Result<Vec<EdgeSegment>, BridgeError> {
    const TASK: &str = "finding straight edges";
    prepare();
    if !roi.fits(frame.size()) || roi.width == 0 || roi.height == 0 {
        let (width, height) = (frame.width(), frame.height());
        let what = format!("{roi:?} is not within an image of {width}x{height} px");
        return Err(BridgeError { task: TASK, what });
    }
    let image = grey8_mat(frame)?;
    let (left, top) = (coordinate(roi.x), coordinate(roi.y));
    let window = Rect::new(left, top, coordinate(roi.width), coordinate(roi.height));
    // A copy: filters on a view would use pixels outside the region.
    let region = image.roi(window).and_then(|view| view.try_clone()).map_err(during(TASK))?;
    let mut finder = LineFinder::new(*settings);
    finder.run(&region).map_err(during(TASK))?;
    let end = |x: i32, y: i32| Point2::new(f64::from(left + x), f64::from(top + y));
    let lines = finder.lines.iter();
    Ok(lines.map(|l| EdgeSegment { from: end(l[0], l[1]), to: end(l[2], l[3]) }).collect())
}

/// Blur, edge detector and Hough transform with memory that is reused from frame to frame, for
/// benchmarks.
#[derive(Debug)]
pub struct LineFinder {
    settings: EdgeSettings,
    blurred: Mat,
    edges: Mat,
    lines: Vector<Vec4i>,
}

impl LineFinder {
    /// With settings that apply to all frames.
    pub fn new(settings: EdgeSettings) -> Self {
        prepare();
        Self { settings, blurred: Mat::default(), edges: Mat::default(), lines: Vector::new() }
    }

    /// Number of straight edges of a whole frame of 8 bits, which is not copied. Fails for 16
    /// bits.
    pub fn count(&mut self, frame: &Frame) -> Result<usize, BridgeError> {
        const TASK: &str = "finding straight edges of a whole frame";
        let Pixels::Grey8(values) = frame.pixels() else {
            return Err(BridgeError { task: TASK, what: "16 bits a pixel".to_owned() });
        };
        let (rows, columns) = (coordinate(frame.height()), coordinate(frame.width()));
        let image = Mat::new_rows_cols_with_data(rows, columns, values).map_err(during(TASK))?;
        self.run(&image).map_err(during(TASK))?;
        Ok(self.lines.len())
    }

    fn run(&mut self, image: &impl ToInputArray) -> opencv::Result<()> {
        let Self { settings, blurred, edges, lines } = self;
        let [low, high] = settings.thresholds;
        let sigma = settings.blur_sigma_px;
        if sigma > 0.0 {
            gaussian_blur(image, blurred, Size::new(0, 0), sigma, sigma, BORDER_DEFAULT)?;
            canny(blurred, edges, low, high, 3, true)?;
        } else {
            canny(image, edges, low, high, 3, true)?;
        }
        hough_lines_p(
            edges,
            lines,
            1.0,
            std::f64::consts::PI / 180.0,
            i32::from(settings.votes),
            settings.shortest_px,
            settings.longest_gap_px,
        )
    }
}

/// A pixel index of OpenCV; the region was checked to be within the image.
fn coordinate(px: usize) -> i32 {
    i32::try_from(px).unwrap_or(i32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::{self, Stamp};

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
        Frame::new(0, Stamp::START, core::Size::new(200, 120), Pixels::Grey8(pixels)).unwrap()
    }

    #[test]
    fn both_edges_of_a_bar_are_found_in_image_pixels() {
        let roi = Roi { x: 20, y: 10, width: 160, height: 100 };
        let lines = canny_hough(&bar(), roi, &SETTINGS).unwrap();
        for edge in [59.5, 139.5] {
            let near =
                |s: &&EdgeSegment| (s.from.x - edge).abs() <= 1.0 && (s.to.x - edge).abs() <= 1.0;
            let length =
                lines.iter().filter(near).map(|s| (s.to - s.from).norm()).fold(0.0, f64::max);
            assert!(length > 80.0, "edge at {edge}: {lines:?}");
        }
        assert_eq!(lines, canny_hough(&bar(), roi, &SETTINGS).unwrap());
    }

    #[test]
    fn a_finder_that_is_kept_finds_what_a_new_one_does() {
        let roi = Roi { x: 0, y: 0, width: 200, height: 120 };
        let found = canny_hough(&bar(), roi, &SETTINGS).unwrap().len();
        let mut finder = LineFinder::new(SETTINGS);
        assert!(found > 0);
        assert_eq!([finder.count(&bar()), finder.count(&bar())], [Ok(found), Ok(found)]);
    }

    #[test]
    fn a_uniform_image_has_no_edges_and_a_region_outside_is_refused() {
        let even =
            Frame::new(0, Stamp::START, core::Size::new(50, 50), Pixels::Grey16(vec![900; 2500]))
                .unwrap();
        let roi = Roi { x: 0, y: 0, width: 50, height: 50 };
        assert_eq!(canny_hough(&even, roi, &SETTINGS).unwrap(), vec![]);
        let outside = Roi { x: 10, ..roi };
        assert!(canny_hough(&even, outside, &SETTINGS).is_err());
    }
}
