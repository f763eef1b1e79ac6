//! Which values of a colour image are the grey values of a frame.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// The part of a colour image that is measured. A grey image is used as it is, whichever channel is
/// chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Channel {
    /// Luma of Rec. 601.
    #[default]
    Grey,
    /// The red values.
    Red,
    /// The green values.
    Green,
    /// The blue values.
    Blue,
}

/// The samples of one pixel, in the order in which they are stored. Alpha is
/// ignored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SampleLayout {
    /// One grey value.
    Grey,
    /// Grey, alpha.
    GreyAlpha,
    /// Red, green, blue.
    Rgb,
    /// Red, green, blue, alpha.
    Rgba,
    /// Blue, green, red.
    Bgr,
    /// Blue, green, red, alpha.
    Bgra,
}

impl SampleLayout {
    /// Samples a pixel.
    pub const fn samples(self) -> usize {
        match self {
            Self::Grey => 1,
            Self::GreyAlpha => 2,
            Self::Rgb | Self::Bgr => 3,
            Self::Rgba | Self::Bgra => 4,
        }
    }

    const fn is_blue_first(self) -> bool {
        matches!(self, Self::Bgr | Self::Bgra)
    }
}

/// A sample of 8 or 16 bits.
pub trait Sample: Copy + Into<u32> {
    /// The low bits of a value, which is known to fit.
    fn of(value: u32) -> Self;
}

impl Sample for u8 {
    fn of(value: u32) -> Self {
        value.to_le_bytes()[0]
    }
}

impl Sample for u16 {
    fn of(value: u32) -> Self {
        let [low, high, ..] = value.to_le_bytes();
        Self::from_le_bytes([low, high])
    }
}

/// Weights of red, green and blue in Rec. 601 luma, times 2^15, as in OpenCV's
/// `cvtColor`, so that a frame has the same grey values whether it came through
/// OpenCV or not. They sum to 2^15.
const LUMA: [u32; 3] = [9798, 19235, 3735];
const LUMA_SHIFT: u32 = 15;

fn luma<T: Sample>([red, green, blue]: [T; 3]) -> T {
    let sum = LUMA[0] * red.into() + LUMA[1] * green.into() + LUMA[2] * blue.into();
    T::of((sum + (1 << (LUMA_SHIFT - 1))) >> LUMA_SHIFT)
}

impl Channel {
    /// One value a pixel from rows of interleaved samples; the depth stays.
    /// Samples that do not fill a last pixel are dropped.
    pub fn extract<T: Sample>(self, samples: &[T], layout: SampleLayout) -> Vec<T> {
        let pixels = samples.chunks_exact(layout.samples());
        if matches!(layout, SampleLayout::Grey | SampleLayout::GreyAlpha) {
            return pixels.map(|pixel| pixel[0]).collect();
        }
        let (red, blue) = if layout.is_blue_first() { (2, 0) } else { (0, 2) };
        match self {
            Self::Grey => pixels.map(|p| luma([p[red], p[1], p[blue]])).collect(),
            Self::Red => pixels.map(|p| p[red]).collect(),
            Self::Green => pixels.map(|p| p[1]).collect(),
            Self::Blue => pixels.map(|p| p[blue]).collect(),
        }
    }

    /// Name of the channel in a cell file.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Grey => "grey",
            Self::Red => "red",
            Self::Green => "green",
            Self::Blue => "blue",
        }
    }
}

impl fmt::Display for Channel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A name that is none of a channel.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("\"{0}\" is not a channel: use \"grey\", \"red\", \"green\" or \"blue\"")]
pub struct UnknownChannel(pub String);

impl FromStr for Channel {
    type Err = UnknownChannel;

    fn from_str(text: &str) -> Result<Self, UnknownChannel> {
        [Self::Grey, Self::Red, Self::Green, Self::Blue]
            .into_iter()
            .find(|channel| channel.name() == text)
            .ok_or_else(|| UnknownChannel(text.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn luma_keeps_grey_grey_at_both_depths() {
        for value in 0..=255_u8 {
            assert_eq!(luma([value; 3]), value);
        }
        for value in (0..=65535_u16).step_by(13).chain([65535]) {
            assert_eq!(luma([value; 3]), value);
        }
        assert_eq!(luma([255_u8, 0, 0]), 76);
        assert_eq!(luma([0_u8, 255, 0]), 150);
        assert_eq!(luma([0_u8, 0, 255]), 29);
    }

    #[test]
    fn each_channel_is_found_in_each_order() {
        let (rgba, bgr) = ([10_u16, 2000, 30000, 7], [30000_u16, 2000, 10]);
        for (channel, value) in [
            (Channel::Red, 10),
            (Channel::Green, 2000),
            (Channel::Blue, 30000),
            (Channel::Grey, 4596),
        ] {
            assert_eq!(channel.extract(&rgba, SampleLayout::Rgba), vec![value]);
            assert_eq!(channel.extract(&bgr, SampleLayout::Bgr), vec![value]);
        }
        assert_eq!(Channel::Blue.extract(&[5_u8, 255], SampleLayout::GreyAlpha), vec![5]);
    }

    #[test]
    fn names_are_read_back() {
        for channel in [Channel::Grey, Channel::Red, Channel::Green, Channel::Blue] {
            assert_eq!(channel.to_string().parse::<Channel>().unwrap(), channel);
        }
        assert!("gray".parse::<Channel>().is_err());
    }
}
