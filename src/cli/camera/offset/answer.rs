//! The result compared with the cell's current value.

use crate::core::Mm;

/// Prints the cell's current value, and the lines with the result for its file.
pub fn tell(offset_mm: f64, sigma_mm: f64, now: Option<Mm>) {
    if let Some(now) = now.map(Mm::get) {
        let off = offset_mm - now;
        say!(
            "cell       has offset_mm = {now}: {:.2} mm {}, {:.1} standard deviations",
            off.abs(),
            if off < 0.0 { "too much" } else { "too little" },
            off.abs() / sigma_mm
        );
    } else {
        say!("cell       has no offset_mm, or is not complete enough to be run");
    }
    say!();
    let places = if sigma_mm < 0.05 { 2 } else { 1 };
    say!("[camera]");
    say!("offset_mm = {offset_mm:.places$}");
    say!("offset_sigma_mm = {sigma_mm:.places$}");
}
