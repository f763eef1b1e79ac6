//! The flow at the nozzle from the laid bead: surface speed times area, both at the moment of
//! extrusion (bcs-thesis, eq. (20)).

/// Flow \[mm³/s\] from speeds \[mm/s\] and areas \[mm²\] of the same moments.
pub fn at_moments(speed_mm_per_s: &[f64], area_mm2: &[f64]) -> Vec<f64> {
    speed_mm_per_s.iter().zip(area_mm2).map(|(speed, area)| speed * area).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;
    use crate::identify::align::to_extruded;

    #[test]
    fn the_flow_that_laid_a_bead_is_found_again() {
        // Flow and speed change at rates of their own; the area is their quotient.
        let flow = |t: f64| 1500.0 + 300.0 * (1.3 * t).sin();
        let speed = |t: f64| 35.0 + 10.0 * (0.7 * t).cos();
        let way = |t: f64| 35.0 * t + 10.0 / 0.7 * (0.7 * t).sin();
        let times: Vec<f64> = (0_u32..6000).map(|k| f64::from(k) * 0.005).collect();
        // The moment at which the material at a position left the nozzle, by bisection.
        let left = |position: f64| {
            let halve = |(low, high): (f64, f64), _| {
                let middle = f64::midpoint(low, high);
                if way(middle) < position { (middle, high) } else { (low, middle) }
            };
            (0..60).fold((-5.0, 40.0), halve).0
        };
        let position_mm: Vec<f64> = times.iter().map(|t| way(*t)).collect();
        let speed_mm_per_s: Vec<f64> = times.iter().map(|t| speed(*t)).collect();
        let area_at = |position: f64| flow(left(position - 40.0)) / speed(left(position - 40.0));
        let area_mm2: Vec<f64> = position_mm.iter().map(|p| area_at(*p)).collect();
        let areas = to_extruded(&position_mm, &area_mm2, 40.0).unwrap();
        let areas: Vec<f64> = areas.into_iter().map_while(|area| area).collect();
        let found = at_moments(&speed_mm_per_s, &areas);
        assert!(found.len() > 5700 && found.len() < 6000, "{}", found.len());
        for (time, found) in times.iter().zip(found) {
            assert!((found - flow(*time)).abs() < 0.01, "{time} s: {found}");
        }
    }
}
