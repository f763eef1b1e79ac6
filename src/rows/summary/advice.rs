//! Advice about light and lens, from the quality of a run's images.
//!
//! The measure is the bound: the standard deviation of widths is proportional to noise over
//! contrast and to the root of the blur (docs/src/explanation/uncertainty.md). An image is
//! compared with one of 80 grey levels of contrast, 4 of noise and a blur of 1.5 px, for which the
//! accuracy tables are valid.

use super::image_quality::ImageQuality;

/// Contrast of the sets where nothing else is said \[grey levels\] (reference/accuracy.md, § The
/// sets).
const REFERENCE_CONTRAST_GREY: f64 = 80.0;
/// Noise of these sets \[grey levels\] (reference/accuracy.md, § The sets).
const REFERENCE_NOISE_GREY: f64 = 4.0;
/// Blur of these sets \[px\] (reference/accuracy.md, § The sets).
const REFERENCE_BLUR_PX: f64 = 1.5;
/// Smallest factor by which an advice must reduce the standard deviation of widths.
const MIN_GAIN_OF_ADVICE: f64 = 1.5;
/// Contrast \[grey levels\] below which shadows, stains and texture of a few grey levels shift an
/// edge, even without noise.
const MIN_CONTRAST_GREY: f64 = 25.0;
/// Largest blur with which the limits of accuracy are met \[px\].
const MAX_BLUR_PX: f64 = 3.2;
/// Blur including that of the pixels \[px\]; below it the position of an edge within a pixel is
/// lost.
const MIN_BLUR_PX: f64 = 0.55;
/// Distance at which two steps are resolved \[blurs\].
const RESOLVED_AT_BLURS: f64 = 4.0;
/// Saturated fraction of the gauge from which the bead itself is clipped. Derived: where half of
/// the gauge is bead, two standard deviations of the noise below the end of the scale, noise alone
/// saturates 0.5·(1 − Φ(2)) = 1.1 %.
const CLIPPED_FRACTION: f64 = 0.01;
/// Fraction of the rows in use, below which the edges count as occluded.
const MIN_USED_FRACTION: f64 = 0.9;
/// Smallest offset of widths by skewed flanks that is reported \[px\].
const MIN_SKEW_PX: f64 = 0.05;
/// Smallest reported offset in its standard deviations. Derived: a run without a skew has as much
/// with P(|z| > 4) = 6e-5.
const SKEW_SIGMAS: f64 = 4.0;

/// One sentence for each possible improvement, the one with the largest effect first; empty if
/// nothing is known.
pub fn advice(hints: &ImageQuality) -> Vec<String> {
    let mut advice = Vec::new();
    advice.extend(hints.saturated_fraction_mean.and_then(on_saturation));
    let known = |value: Option<f64>| value.filter(|value| *value > 0.0);
    let (contrast, noise) = (known(hints.contrast_median_grey), known(hints.noise_median_grey));
    if let (Some(contrast), Some(noise)) = (contrast, noise) {
        advice.extend(on_contrast(contrast, noise));
        advice.extend(on_noise(contrast, noise));
    }
    advice.extend(known(hints.blur_median_px).and_then(on_blur));
    advice.extend(hints.used_fraction_mean.and_then(on_rows));
    let skew = hints.skew_offset_px.zip(hints.skew_offset_sigma_px);
    advice.extend(skew.and_then(|(offset, sigma)| on_skew(offset, sigma)));
    advice
}

/// Cramér–Rao bound of an edge's position in one row \[px\]: standard deviation.
pub fn row_cramer_rao_px(hints: &ImageQuality) -> Option<f64> {
    let (contrast, noise) = (hints.contrast_median_grey?, hints.noise_median_grey?);
    let blur = hints.blur_median_px?;
    let root = (2.0 * std::f64::consts::PI.sqrt()).sqrt();
    (contrast > 0.0 && blur > 0.0).then(|| root * noise / contrast * blur.sqrt())
}

fn on_saturation(fraction: f64) -> Option<String> {
    (fraction > CLIPPED_FRACTION).then(|| {
        format!(
            "{:.0} % of the gauge's pixels are saturated: shorten the exposure, or turn the light \
             out of the mirror direction. Clipped pixels move the edges, and sigma does not \
             know it.",
            fraction * 100.0
        )
    })
}

/// Ratio of the standard deviation of widths to that with the reference's contrast and noise.
fn precision_lost(contrast: f64, noise: f64) -> f64 {
    (noise / contrast) / (REFERENCE_NOISE_GREY / REFERENCE_CONTRAST_GREY)
}

fn on_contrast(contrast: f64, noise: f64) -> Option<String> {
    let low = contrast < REFERENCE_CONTRAST_GREY / MIN_GAIN_OF_ADVICE
        && precision_lost(contrast, noise) > MIN_GAIN_OF_ADVICE;
    (low || contrast < MIN_CONTRAST_GREY).then(|| {
        format!(
            "Contrast {contrast:.0} grey levels of 256: light the bead more from the side, or \
             measure another channel. Twice the contrast halves the noise of the widths, \
             and what shadows and stains do to them."
        )
    })
}

fn on_noise(contrast: f64, noise: f64) -> Option<String> {
    let by_contrast_alone = contrast < REFERENCE_CONTRAST_GREY / MIN_GAIN_OF_ADVICE
        && noise <= REFERENCE_NOISE_GREY * MIN_GAIN_OF_ADVICE;
    (precision_lost(contrast, noise) > MIN_GAIN_OF_ADVICE && !by_contrast_alone).then(|| {
        format!(
            "Noise {noise:.1} grey levels: more light or a longer exposure in place of gain. Half \
             the noise halves that of the widths."
        )
    })
}

fn on_blur(blur: f64) -> Option<String> {
    if blur < MIN_BLUR_PX {
        return Some(format!(
            "Blur {blur:.1} px: the lens is sharper than the pixels, so that the position of an edge \
             within a pixel is not seen, and sigma is too small. Put it out of focus a little, to \
             0.8 px or more."
        ));
    }
    (blur > MAX_BLUR_PX).then(|| {
        format!(
            "Blur {blur:.1} px: refocus on the top edges of the bead, or shorten the exposure if \
             it smears (torn edges look blurred in focus as well). At {REFERENCE_BLUR_PX} px widths of a \
             smooth bead would have {:.0} % less noise, and a shadow be distinguished from an edge {:.0} px \
             away, not only {:.0} px.",
            (1.0 - (REFERENCE_BLUR_PX / blur).sqrt()) * 100.0,
            RESOLVED_AT_BLURS * REFERENCE_BLUR_PX,
            RESOLVED_AT_BLURS * blur
        )
    })
}

fn on_rows(fraction: f64) -> Option<String> {
    (fraction < MIN_USED_FRACTION).then(|| {
        format!(
            "Only {:.0} % of the rows show the edges: look at the images for grains, glare and \
             shadows on them.",
            fraction * 100.0
        )
    })
}

fn on_skew(offset: f64, sigma: f64) -> Option<String> {
    let is_sure = offset.abs() > MIN_SKEW_PX && offset.abs() > SKEW_SIGMAS * sigma;
    is_sure.then(|| {
        let way = if offset > 0.0 { "wide" } else { "narrow" };
        format!(
            "The flanks of the edges are skewed: widths look {:.2} ± {sigma:.2} px too {way} by that, \
             which sigma contains only where a single frame shows it. Causes are a camera whose grey \
             is not proportional to light (switch its gamma off, or give gamma in [gauge]), the rounded \
             shoulders of a bead, or the soft boundary of a shadow beside it.",
            offset.abs()
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hints(contrast: f64, noise: f64, blur: f64, saturated: f64, used: f64) -> ImageQuality {
        ImageQuality {
            contrast_median_grey: Some(contrast),
            blur_median_px: Some(blur),
            noise_median_grey: Some(noise),
            saturated_fraction_mean: Some(saturated),
            used_fraction_mean: Some(used),
            skew_offset_px: Some(0.01),
            skew_offset_sigma_px: Some(0.001),
        }
    }

    fn begins(hints: &ImageQuality, expected: &[&str]) {
        let advice = advice(hints);
        assert_eq!(advice.len(), expected.len(), "{advice:?}");
        for (sentence, begin) in advice.iter().zip(expected) {
            assert!(sentence.starts_with(begin), "{sentence} / {begin}");
        }
    }

    #[test]
    fn images_for_which_the_accuracy_holds_need_no_advice() {
        begins(&hints(80.0, 4.0, 1.5, 0.0, 1.0), &[]);
        begins(&hints(80.0, 4.0, 3.02, 0.0, 1.0), &[]);
        begins(&hints(80.0, 4.0, 0.85, 0.0, 1.0), &[]);
        // Low contrast, but even lower noise.
        begins(&hints(40.0, 0.5, 1.5, 0.0, 1.0), &[]);
    }

    #[test]
    fn each_fault_has_its_remedy() {
        begins(&hints(80.0, 4.0, 4.1, 0.0, 1.0), &["Blur 4.1 px: refocus"]);
        begins(&hints(80.0, 4.0, 0.41, 0.0, 1.0), &["Blur 0.4 px: the lens is sharper"]);
        begins(&hints(20.0, 2.0, 1.5, 0.0, 1.0), &["Contrast 20"]);
        begins(&hints(20.0, 0.2, 1.5, 0.0, 1.0), &["Contrast 20"]);
        begins(&hints(120.0, 12.0, 1.5, 0.0, 1.0), &["Noise 12.0"]);
        begins(&hints(60.0, 5.5, 1.5, 0.0, 1.0), &["Noise 5.5"]);
        begins(&hints(20.0, 8.0, 1.5, 0.0, 1.0), &["Contrast 20", "Noise 8.0"]);
        begins(&hints(80.0, 4.0, 1.5, 0.12, 1.0), &["12 % of the gauge's pixels are saturated"]);
        begins(&hints(80.0, 4.0, 1.5, 0.0, 0.7), &["Only 70 % of the rows"]);
    }

    #[test]
    fn skewed_flanks_are_reported_where_they_are_significant_and_large() {
        let skewed = |offset: f64, sigma: f64| ImageQuality {
            skew_offset_px: Some(offset),
            skew_offset_sigma_px: Some(sigma),
            ..hints(80.0, 4.0, 1.5, 0.0, 1.0)
        };
        begins(&skewed(0.4, 0.2), &[]);
        begins(
            &skewed(0.38, 0.04),
            &["The flanks of the edges are skewed: widths look 0.38 ± 0.04 px too wide"],
        );
        begins(
            &skewed(-0.3, 0.04),
            &["The flanks of the edges are skewed: widths look 0.30 ± 0.04 px too narrow"],
        );
    }

    #[test]
    fn what_is_not_known_gives_no_advice() {
        let nothing = ImageQuality {
            contrast_median_grey: None,
            blur_median_px: None,
            noise_median_grey: None,
            saturated_fraction_mean: None,
            used_fraction_mean: None,
            skew_offset_px: None,
            skew_offset_sigma_px: None,
        };
        begins(&nothing, &[]);
        assert_eq!(row_cramer_rao_px(&nothing), None);
        // The 2022 paper's method reports neither contrast nor noise.
        begins(&hints(0.0, 0.0, 0.0, 0.0, 1.0), &[]);
    }

    #[test]
    fn a_row_has_the_bound_of_the_documentation() {
        let bound = row_cramer_rao_px(&hints(80.0, 4.0, 1.5, 0.0, 1.0)).unwrap();
        assert!((bound - 1.883 * 4.0 / 80.0 * 1.5f64.sqrt()).abs() < 1e-4, "{bound}");
    }

    #[test]
    fn thresholds_are_those_of_a_normal_deviate() {
        let beyond = |sigmas: f64| libm::erfc(sigmas / std::f64::consts::SQRT_2);
        // Half of the gauge is bead, and only the upper end of the normal distribution is clipped.
        let clipped = 0.5 * 0.5 * beyond(2.0);
        assert!((CLIPPED_FRACTION / clipped - 1.0).abs() < 0.15, "{clipped}");
        assert!((beyond(SKEW_SIGMAS) / 6e-5 - 1.0).abs() < 0.1);
    }
}
