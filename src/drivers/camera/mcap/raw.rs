//! Converts a `foxglove.RawImage` to a frame.

use crate::core::{Channel, Frame, Pixels, SampleLayout, Size, Stamp};
use crate::io::foxglove::RawImage;

/// The encodings that can be decoded.
const KNOWN: &str = "mono8, mono16, 8UC1, 16UC1, rgb8, bgr8, rgba8, bgra8 and 8UC3";

enum Depth {
    Eight,
    Sixteen,
}

/// Decodes the encodings of [`KNOWN`]; 16-bit values are little-endian, as in the schema. `8UC3`
/// is decoded as `bgr8`. Fails with a message.
pub fn decode(
    image: &RawImage,
    channel: Channel,
    seq: u64,
    captured_at: Stamp,
) -> Result<Frame, String> {
    let (layout, depth) = match image.encoding.as_str() {
        "mono8" | "8UC1" => (SampleLayout::Grey, Depth::Eight),
        "mono16" | "16UC1" => (SampleLayout::Grey, Depth::Sixteen),
        "rgb8" => (SampleLayout::Rgb, Depth::Eight),
        "rgba8" => (SampleLayout::Rgba, Depth::Eight),
        "bgr8" | "8UC3" => (SampleLayout::Bgr, Depth::Eight),
        "bgra8" => (SampleLayout::Bgra, Depth::Eight),
        other => return Err(format!("its encoding is \"{other}\"; read are {KNOWN}")),
    };
    let sample_bytes = match depth {
        Depth::Eight => 1,
        Depth::Sixteen => 2,
    };
    let rows = rows(image, layout.samples() * sample_bytes)?;
    let size = (image.width as usize, image.height as usize);
    let pixels = match depth {
        Depth::Eight => Pixels::Grey8(channel.extract(&rows, layout)),
        Depth::Sixteen => Pixels::Grey16(
            rows.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]])).collect(),
        ),
    };
    Frame::new(seq, captured_at, Size::new(size.0, size.1), pixels)
        .map_err(|error| error.to_string())
}

/// The rows without their padding.
fn rows(image: &RawImage, pixel_bytes: usize) -> Result<Vec<u8>, String> {
    let (step, height) = (image.step as usize, image.height as usize);
    let row = (image.width as usize).saturating_mul(pixel_bytes);
    if row == 0 || height == 0 {
        return Err(format!("it is {}x{} px", image.width, image.height));
    }
    if step < row {
        return Err(format!(
            "its rows are {step} bytes apart, {} px of {} need {row}",
            image.width, image.encoding
        ));
    }
    let needed = step.saturating_mul(height - 1).saturating_add(row);
    if image.data.len() < needed {
        return Err(format!("it has {} bytes, its size needs {needed}", image.data.len()));
    }
    Ok(image.data.chunks(step).take(height).flat_map(|line| &line[..row]).copied().collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(encoding: &str, (width, height, step): (u32, u32, u32), data: &[u8]) -> RawImage {
        RawImage {
            width,
            height,
            step,
            encoding: encoding.into(),
            data: data.to_vec(),
            ..RawImage::default()
        }
    }

    fn pixels(raw: &RawImage, channel: Channel) -> Pixels {
        decode(raw, channel, 0, Stamp::START).unwrap().pixels().clone()
    }

    #[test]
    fn padding_between_rows_is_left_out_and_may_miss_after_the_last() {
        let raw = image("mono8", (2, 2, 3), &[1, 2, 99, 3, 4]);
        assert_eq!(pixels(&raw, Channel::Grey), Pixels::Grey8(vec![1, 2, 3, 4]));
    }

    #[test]
    fn sixteen_bits_are_little_endian() {
        let raw = image("16UC1", (2, 1, 4), &[0x34, 0x12, 0xff, 0x00]);
        assert_eq!(pixels(&raw, Channel::Blue), Pixels::Grey16(vec![0x1234, 0x00ff]));
    }

    #[test]
    fn colours_lie_where_the_encoding_has_them() {
        let data = [10, 20, 30, 40, 50, 60];
        let red = |encoding| pixels(&image(encoding, (2, 1, 6), &data), Channel::Red);
        assert_eq!(red("rgb8"), Pixels::Grey8(vec![10, 40]));
        assert_eq!(red("bgr8"), Pixels::Grey8(vec![30, 60]));
        let with_alpha = image("bgra8", (1, 1, 4), &[10, 20, 30, 255]);
        assert_eq!(pixels(&with_alpha, Channel::Blue), Pixels::Grey8(vec![10]));
    }

    #[test]
    fn what_does_not_fit_is_refused_in_words() {
        let what = |raw| decode(&raw, Channel::Grey, 0, Stamp::START).unwrap_err();
        assert!(what(image("bayer_rggb8", (2, 1, 2), &[0; 2])).contains("\"bayer_rggb8\""));
        assert!(what(image("mono8", (2, 2, 2), &[0; 3])).contains("needs 4"));
        assert!(what(image("rgb8", (2, 1, 4), &[0; 4])).contains("need 6"));
        assert!(what(image("mono8", (0, 5, 0), &[])).contains("0x5 px"));
        let huge = u32::MAX;
        assert!(
            decode(&image("rgba8", (huge, huge, huge), &[]), Channel::Grey, 0, Stamp::START)
                .is_err()
        );
    }
}
