//! Random numbers as a function of their purpose (a seed, a position), independent of the
//! order of evaluation.

use std::f64::consts::TAU;

/// Mixes words to one hash; rows that differ in one bit give unrelated hashes (the finalizer of
/// `SplitMix64`, Steele et al. 2014, after each word).
pub fn mix(words: &[u64]) -> u64 {
    words.iter().fold(0x9e37_79b9_7f4a_7c15, |state, word| finish(state ^ finish(*word)))
}

fn finish(word: u64) -> u64 {
    let mut z = word.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Two independent standard normal numbers of a key (Box and Muller 1958).
pub fn normal_pair(key: u64) -> [f64; 2] {
    let radius = (-2.0 * libm::log(open_unit(finish(key)))).sqrt();
    let (sin, cos) = libm::sincos(TAU * open_unit(finish(!key)));
    [radius * cos, radius * sin]
}

/// A uniform random number between 0 and 1 for a key; neither end is included.
pub fn unit(key: u64) -> f64 {
    open_unit(finish(key))
}

/// A uniform number between 0 and 1 from a word; neither end is included.
#[expect(clippy::cast_precision_loss, reason = "53 bits fit")]
fn open_unit(word: u64) -> f64 {
    ((word >> 11) as f64 + 0.5) * (1.0 / (1_u64 << 53) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hashed_normals_have_the_moments_of_normals() {
        let n = 200_000_u32;
        let (mut sum, mut square, mut fourth, mut cross) = (0.0, 0.0, 0.0, 0.0);
        for i in 0..n {
            let [a, b] = normal_pair(mix(&[7, u64::from(i)]));
            sum += a + b;
            square += a * a + b * b;
            fourth += a.powi(4) + b.powi(4);
            cross += a * b;
        }
        let n = f64::from(n);
        // Four standard errors each.
        assert!((sum / (2.0 * n)).abs() < 4.0 / (2.0 * n).sqrt());
        assert!((square / (2.0 * n) - 1.0).abs() < 4.0 * (2.0 / (2.0 * n)).sqrt());
        assert!((fourth / (2.0 * n) - 3.0).abs() < 4.0 * (96.0 / (2.0 * n)).sqrt());
        assert!((cross / n).abs() < 4.0 / n.sqrt());
    }

    #[test]
    fn the_order_of_the_words_counts() {
        assert_ne!(mix(&[1, 2]), mix(&[2, 1]));
        assert_ne!(mix(&[1]), mix(&[1, 0]));
    }
}
