//! Pseudo-random binary sequences of maximum length from shift registers with feedback
//! (bcs-thesis, eq. (15); taps of primitive polynomials).

/// An unsupported register length.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a sequence of {bits} bits: expected 3 to 16")]
pub struct NoSuchLength {
    /// The requested length.
    pub bits: u32,
}

/// An endless sequence with a period of 2^bits − 1 bits, one more one than zeros in each. It
/// begins with `bits` ones.
#[derive(Debug, Clone)]
pub struct Prbs {
    register: u32,
    taps: u32,
    bits: u32,
}

impl Prbs {
    /// The sequence of a register of 3 to 16 bits.
    pub fn new(bits: u32) -> Result<Self, NoSuchLength> {
        let taps = taps(bits).ok_or(NoSuchLength { bits })?;
        Ok(Self { register: (1 << bits) - 1, taps, bits })
    }

    /// Bits after which it repeats itself.
    pub fn period(&self) -> u32 {
        (1 << self.bits) - 1
    }
}

impl Iterator for Prbs {
    type Item = bool;

    /// The oldest bit leaves; the parity of the tapped bits enters.
    fn next(&mut self) -> Option<bool> {
        let oldest = self.register & 1 == 1;
        let entering = (self.register & self.taps).count_ones() & 1;
        self.register = (self.register >> 1) | (entering << (self.bits - 1));
        Some(oldest)
    }
}

/// Mask of the tapped bits, the oldest being the lowest: x^t for each term but the highest of a
/// primitive polynomial.
fn taps(bits: u32) -> Option<u32> {
    let inner: &[u32] = match bits {
        3 => &[2],
        4 | 5 => &[3],
        6 | 9 => &[5],
        7 => &[6],
        8 => &[7, 6, 1],
        10 => &[7],
        11 => &[9],
        12 => &[11, 10, 4],
        13 => &[12, 11, 8],
        14 => &[13, 12, 2],
        15 => &[14],
        16 => &[15, 13, 4],
        _ => return None,
    };
    Some(inner.iter().fold(1, |mask, tap| mask | 1 << tap))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;

    /// From an independent implementation.
    const FIRST: [(u32, &str); 4] = [
        (7, "1111111010101001100111011101001011000110111101101011011001001000"),
        (9, "1111111110000111101110000101100110110111101000011100110000100100"),
        (10, "1111111111000111000100111011001010111011110101000111101001010100"),
        (11, "1111111111100110011001011010010111000101110010100011010001010010"),
    ];

    #[test]
    fn they_begin_as_those_of_others_do() {
        for (bits, expected) in FIRST {
            let first: String =
                Prbs::new(bits).unwrap().take(64).map(|b| if b { '1' } else { '0' }).collect();
            assert_eq!(first, expected, "{bits} bits");
        }
    }

    #[test]
    fn every_length_is_maximal() {
        for bits in 3..=16 {
            let mut sequence = Prbs::new(bits).unwrap();
            let (first, period) = (sequence.register, sequence.period());
            let mut ones = 0;
            for step in 1..=period {
                ones += u32::from(sequence.next().unwrap());
                assert_eq!(sequence.register == first, step == period, "{bits} bits at {step}");
            }
            assert_eq!(ones, 1 << (bits - 1), "{bits} bits");
        }
    }

    #[test]
    fn other_lengths_are_refused() {
        for bits in [0, 2, 17, 32, 99] {
            assert_eq!(Prbs::new(bits).unwrap_err(), NoSuchLength { bits });
        }
    }
}
