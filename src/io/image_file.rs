//! Image files and frames: PNG, JPEG, TIFF, BMP, PNM and WebP, grey or colour,
//! 8 or 16 bits.

use std::fs;
use std::io::{self, Cursor};
use std::path::{Path, PathBuf};

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{DynamicImage, ImageBuffer, ImageError, ImageFormat, ImageReader};

use crate::core::{Channel, Frame, Pixels, SampleLayout, Size, Stamp, WrongSize};

/// Extensions of image files, without the dot and in lower case.
pub const EXTENSIONS: [&str; 12] =
    ["png", "jpg", "jpeg", "tif", "tiff", "bmp", "pgm", "ppm", "pbm", "pnm", "pam", "webp"];

/// Marker SOS of a JPEG (ISO 10918-1, table B.1).
const START_OF_SCAN: [u8; 2] = [0xff, 0xda];
/// Marker EOI of a JPEG (ISO 10918-1, table B.1).
const END_OF_IMAGE: [u8; 2] = [0xff, 0xd9];

/// Why bytes cannot be decoded to an image.
#[derive(Debug, thiserror::Error)]
pub enum DecodeError {
    /// No bytes, as after an interrupted write.
    #[error("it is empty")]
    Empty,
    /// The first bytes are not those of a known format.
    #[error("it is not a PNG, JPEG, TIFF, BMP, PNM or WebP image")]
    UnknownFormat,
    /// A JPEG without its end; the missing part would be decoded as grey.
    #[error("it is truncated")]
    Truncated,
    /// The content is damaged or not supported.
    #[error("it cannot be decoded: {0}")]
    Broken(#[source] ImageError),
    /// The samples are not grey values of 8 or 16 bits.
    #[error("its samples are {found}; only 8 and 16 bits are measured, so convert it first")]
    SampleKind {
        /// Name of the sample type in the decoder.
        found: String,
    },
    /// The decoder gave a wrong number of values.
    #[error(transparent)]
    Size(#[from] WrongSize),
}

/// Why a file gives no frame.
#[derive(Debug, thiserror::Error)]
pub enum ImageFileError {
    /// The file cannot be read.
    #[error("{}: {what}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Error of the system.
        what: io::Error,
    },
    /// The content cannot be decoded.
    #[error("{}: {what}", path.display())]
    Decode {
        /// The file.
        path: PathBuf,
        /// Error of the decoder.
        what: DecodeError,
    },
}

/// A frame that cannot be written as an image.
#[derive(Debug, thiserror::Error)]
#[error("a frame of {width}x{height} px cannot be written as PNG: {what}")]
pub struct EncodeError {
    width: usize,
    height: usize,
    what: String,
}

/// Whether a file name has an image's extension, in upper or lower case.
pub fn has_image_extension(path: &Path) -> bool {
    let extension = path.extension().and_then(|ending| ending.to_str());
    extension
        .is_some_and(|ending| EXTENSIONS.iter().any(|known| known.eq_ignore_ascii_case(ending)))
}

/// Reads an image file. Values stay as stored: 10 or 12 bits in a 16-bit file are not stretched.
/// (Only a PNM with a maximum other than 255 or 65535 is scaled to that maximum.)
pub fn read(
    path: &Path,
    channel: Channel,
    seq: u64,
    captured_at: Stamp,
) -> Result<Frame, ImageFileError> {
    let bytes =
        fs::read(path).map_err(|what| ImageFileError::Read { path: path.to_owned(), what })?;
    decode(&bytes, channel, seq, captured_at)
        .map_err(|what| ImageFileError::Decode { path: path.to_owned(), what })
}

/// Decodes the bytes of an image file; the format is recognised by the first bytes, not by a file
/// name. An orientation in the metadata is not applied: pixels stay where the sensor had them.
pub fn decode(
    bytes: &[u8],
    channel: Channel,
    seq: u64,
    captured_at: Stamp,
) -> Result<Frame, DecodeError> {
    if bytes.is_empty() {
        return Err(DecodeError::Empty);
    }
    let reader = ImageReader::new(Cursor::new(bytes))
        .with_guessed_format()
        .map_err(|error| DecodeError::Broken(ImageError::IoError(error)))?;
    match reader.format() {
        None => return Err(DecodeError::UnknownFormat),
        Some(ImageFormat::Jpeg) if is_truncated(bytes) => return Err(DecodeError::Truncated),
        Some(_) => {}
    }
    let image = reader.decode().map_err(DecodeError::Broken)?;
    let size = (image.width() as usize, image.height() as usize);
    Ok(Frame::new(seq, captured_at, Size::new(size.0, size.1), grey_values(image, channel)?)?)
}

/// Whether a JPEG has no end after the start of its last scan. Its decoder fills the missing part
/// without an error; the other decoders fail.
fn is_truncated(jpeg: &[u8]) -> bool {
    let last = |marker: [u8; 2]| jpeg.windows(2).rposition(|pair| pair == marker);
    last(END_OF_IMAGE) < last(START_OF_SCAN)
}

fn grey_values(image: DynamicImage, channel: Channel) -> Result<Pixels, DecodeError> {
    use DynamicImage as Image;
    Ok(match image {
        Image::ImageLuma8(grey) => Pixels::Grey8(grey.into_raw()),
        Image::ImageLuma16(grey) => Pixels::Grey16(grey.into_raw()),
        Image::ImageLumaA8(data) => Pixels::Grey8(channel.extract(&data, SampleLayout::GreyAlpha)),
        Image::ImageLumaA16(data) => {
            Pixels::Grey16(channel.extract(&data, SampleLayout::GreyAlpha))
        }
        Image::ImageRgb8(data) => Pixels::Grey8(channel.extract(&data, SampleLayout::Rgb)),
        Image::ImageRgb16(data) => Pixels::Grey16(channel.extract(&data, SampleLayout::Rgb)),
        Image::ImageRgba8(data) => Pixels::Grey8(channel.extract(&data, SampleLayout::Rgba)),
        Image::ImageRgba16(data) => Pixels::Grey16(channel.extract(&data, SampleLayout::Rgba)),
        other => {
            return Err(DecodeError::SampleKind { found: format!("{:?}", other.color()) });
        }
    })
}

/// Encodes a frame as PNG with its own bit depth; fast compression, not small files.
pub fn encode_png(frame: &Frame) -> Result<Vec<u8>, EncodeError> {
    let Size { width, height } = frame.size();
    let failed = |what: String| EncodeError { width, height, what };
    let side = |px: usize| u32::try_from(px).map_err(|_| failed("a side is too long".to_owned()));
    let (columns, rows) = (side(width)?, side(height)?);
    let image = match frame.pixels() {
        Pixels::Grey8(values) => {
            ImageBuffer::from_raw(columns, rows, values.clone()).map(DynamicImage::ImageLuma8)
        }
        Pixels::Grey16(values) => {
            ImageBuffer::from_raw(columns, rows, values.clone()).map(DynamicImage::ImageLuma16)
        }
    };
    let image = image.ok_or_else(|| failed("its pixels do not fill it".to_owned()))?;
    let mut bytes = Vec::new();
    let encoder = PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Sub);
    image.write_with_encoder(encoder).map_err(|error| failed(error.to_string()))?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bytes_of(image: &DynamicImage, format: ImageFormat) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        image.write_to(&mut bytes, format).unwrap();
        bytes.into_inner()
    }

    fn decoded(bytes: &[u8], channel: Channel) -> Frame {
        decode(bytes, channel, 3, Stamp::from_ns(9)).unwrap()
    }

    #[test]
    fn grey_images_of_both_depths_keep_their_values() {
        let deep: Vec<u16> = vec![0, 1, 1023, 4095, 40000, 65535];
        let deep_image =
            DynamicImage::ImageLuma16(ImageBuffer::from_raw(3, 2, deep.clone()).unwrap());
        for format in [ImageFormat::Png, ImageFormat::Tiff, ImageFormat::Pnm] {
            let frame = decoded(&bytes_of(&deep_image, format), Channel::Red);
            assert_eq!((frame.size(), frame.seq, frame.captured_at.ns()), (Size::new(3, 2), 3, 9));
            assert_eq!(frame.pixels(), &Pixels::Grey16(deep.clone()), "{format:?}");
        }
        let flat: Vec<u8> = vec![0, 1, 127, 128, 254, 255];
        let flat_image =
            DynamicImage::ImageLuma8(ImageBuffer::from_raw(3, 2, flat.clone()).unwrap());
        for format in [ImageFormat::Png, ImageFormat::Tiff, ImageFormat::Pnm, ImageFormat::Bmp] {
            let frame = decoded(&bytes_of(&flat_image, format), Channel::Grey);
            assert_eq!(frame.pixels(), &Pixels::Grey8(flat.clone()), "{format:?}");
        }
    }

    #[test]
    fn colour_images_give_the_channel_that_was_asked_for() {
        let deep = DynamicImage::ImageRgb16(
            ImageBuffer::from_raw(2, 1, vec![10, 2000, 30000, 1, 2, 3]).unwrap(),
        );
        let bytes = bytes_of(&deep, ImageFormat::Png);
        assert_eq!(decoded(&bytes, Channel::Green).pixels(), &Pixels::Grey16(vec![2000, 2]));
        assert_eq!(decoded(&bytes, Channel::Grey).pixels(), &Pixels::Grey16(vec![4596, 2]));
        let clear = DynamicImage::ImageRgba8(
            ImageBuffer::from_raw(2, 1, vec![255, 0, 0, 0, 0, 0, 255, 9]).unwrap(),
        );
        for format in [ImageFormat::Png, ImageFormat::WebP, ImageFormat::Tiff] {
            let bytes = bytes_of(&clear, format);
            assert_eq!(decoded(&bytes, Channel::Blue).pixels(), &Pixels::Grey8(vec![0, 255]));
            assert_eq!(decoded(&bytes, Channel::Grey).pixels(), &Pixels::Grey8(vec![76, 29]));
        }
    }

    #[test]
    fn a_pnm_that_names_its_white_has_it_at_the_top() {
        let mut bytes = b"P5 2 1 1023\n".to_vec();
        bytes.extend([0x03, 0xff, 0x00, 0x10]);
        assert_eq!(decoded(&bytes, Channel::Grey).pixels(), &Pixels::Grey16(vec![65535, 1025]));
    }

    #[test]
    fn a_frame_survives_as_png() {
        for pixels in
            [Pixels::Grey8(vec![0, 7, 200, 255]), Pixels::Grey16(vec![0, 300, 4095, 65535])]
        {
            let frame = Frame::new(3, Stamp::from_ns(9), Size::new(2, 2), pixels).unwrap();
            assert_eq!(decoded(&encode_png(&frame).unwrap(), Channel::Grey), frame);
        }
    }

    #[test]
    fn what_is_no_image_is_refused() {
        use ImageFormat::{Bmp, Jpeg, Png, Pnm, Tiff, WebP};
        let fault = |bytes: &[u8]| decode(bytes, Channel::Grey, 0, Stamp::START).unwrap_err();
        assert!(matches!(fault(b""), DecodeError::Empty));
        assert!(matches!(fault(b"frame,time_s\n"), DecodeError::UnknownFormat));
        for format in [Png, Jpeg, Tiff, Bmp, Pnm, WebP] {
            let whole = bytes_of(&DynamicImage::new_rgb8(64, 48), format);
            assert!(decode(&whole, Channel::Grey, 0, Stamp::START).is_ok(), "{format:?}");
            let cut = fault(&whole[..whole.len() * 3 / 4]);
            assert!(matches!(cut, DecodeError::Broken(_) | DecodeError::Truncated), "{format:?}");
        }
        let float = bytes_of(&DynamicImage::new_rgb32f(2, 2), ImageFormat::Tiff);
        assert!(fault(&float).to_string().contains("Rgb32F"));
        let missing = read(Path::new("no/such.png"), Channel::Grey, 0, Stamp::START).unwrap_err();
        assert!(missing.to_string().starts_with("no/such.png: "));
    }

    #[test]
    fn image_names_are_recognised() {
        assert!(has_image_extension(Path::new("a/left01.JPG")));
        assert!(!has_image_extension(Path::new("times.csv")));
        assert!(!has_image_extension(Path::new("png")));
    }
}
