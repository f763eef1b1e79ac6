//! Keys that have another name now; the table goes before version 1.0.

/// Former names of keys, each with its present one.
const RENAMED: [(&str, &str); 26] = [
    ("law", "strategy"),
    ("law", "controller"),
    ("law", "feedback"),
    ("step_share", "step_fraction"),
    ("foretold_from", "predicted_from"),
    ("late_s", "max_delay_s"),
    ("wander_mpa2", "drift_mpa2"),
    ("weak_zone_share", "weak_zone_fraction"),
    ("pulsation_share", "pulsation_fraction"),
    ("most_filling", "max_filling"),
    ("gain_wave_share", "gain_wave_fraction"),
    ("fastest_rpm", "max_rpm"),
    ("screw_s", "screw_lag_s"),
    ("void_scatter", "void_sigma"),
    ("flow_scatter", "flow_sigma"),
    ("delay_scatter_s", "delay_sigma_s"),
    ("width_sigma_share", "width_relative_sigma"),
    ("outlier_share", "outlier_fraction"),
    ("missing_share", "missing_fraction"),
    ("flow_wave_share", "flow_wave_amplitude"),
    ("flow_pulse_share", "flow_pulse_amplitude"),
    ("spot_share", "spot_fraction"),
    ("grain_rows_share", "grain_rows_fraction"),
    ("shadow_share", "shadow_contrast_fraction"),
    ("neighbour_share", "neighbour_contrast_fraction"),
    ("seen", "data"),
];

/// The present name of a key that a table knows, from a former one.
pub(super) fn present_name(former: &str, is_known: impl Fn(&str) -> bool) -> Option<&'static str> {
    RENAMED.iter().find(|(old, new)| *old == former && is_known(new)).map(|(_, new)| *new)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_former_name_gives_the_key_that_the_table_knows() {
        assert_eq!(present_name("law", |key| key == "controller"), Some("controller"));
        assert_eq!(present_name("law", |key| key == "strategy"), Some("strategy"));
        assert_eq!(present_name("law", |_| false), None);
        assert_eq!(present_name("strategy", |_| true), None);
    }
}
