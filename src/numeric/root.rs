//! Zeros of functions of one variable.

/// Derived: 60 bisections leave 2^-60 of an interval, below double precision, 2^-53.
pub const BISECTIONS: u32 = 60;

/// Where a function changes its sign between two points, after a number of bisections.
pub fn bisect(f: impl Fn(f64) -> f64, mut low: f64, mut high: f64, bisections: u32) -> f64 {
    // One of the two values may be zero.
    let falls = f(low) > f(high);
    for _ in 0..bisections {
        let middle = f64::midpoint(low, high);
        if (f(middle) > 0.0) == falls { low = middle } else { high = middle }
    }
    f64::midpoint(low, high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_root_at_an_end_is_found() {
        for sign in [1.0, -1.0] {
            for [low, high] in [[0.0, 3.0], [-3.0, 0.0]] {
                let found = bisect(|x| sign * x, low, high, BISECTIONS);
                assert!(found.abs() < 1e-15, "{found}");
            }
        }
    }

    #[test]
    fn the_root_of_two_is_found_to_the_last_digit_whichever_way_the_function_goes() {
        for sign in [1.0, -1.0] {
            let found = bisect(|x| sign * (x * x - 2.0), 1.0, 2.0, BISECTIONS);
            assert!((found - 2.0_f64.sqrt()).abs() < 1e-15);
        }
    }
}
