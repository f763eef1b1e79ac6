//! Alignment of a measured output with the moment of extrusion: a bead is measured some
//! distance behind the nozzle. The delay changes with the speed, the distance is constant
//! (bcs-thesis, 3.1.2 and table 2). The value for a sample is the one that was measured once
//! the material had moved on by the offset, interpolated between the two samples that bracket
//! it.

/// Samples that cannot be aligned, counted from 1.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum AlignError {
    /// Columns of different lengths.
    #[error("{positions} positions and {measured} measured values: expected one of each a sample")]
    Length {
        /// Number of positions.
        positions: usize,
        /// Number of measured values.
        measured: usize,
    },
    /// The position of measurement is ahead of the nozzle.
    #[error("an offset of {offset}: expected the way from nozzle to measurement, 0 or more")]
    Offset {
        /// The specified offset.
        offset: f64,
    },
    /// A position below the one before.
    #[error(
        "the position falls from {before} to {position} at sample {at}: expected one that only \
         grows; turn its sign, or use one bead alone"
    )]
    Falls {
        /// Number of the sample.
        at: usize,
        /// Position there.
        position: f64,
        /// Position before.
        before: f64,
    },
    /// A position that is not finite.
    #[error("the position of sample {at} is {position}")]
    NotFinite {
        /// Number of the sample.
        at: usize,
        /// The position.
        position: f64,
    },
}

/// The measured values at the moments of extrusion, with the offset in the unit of the
/// positions (mm, or encoder counts). `None` at the end, where the material has not moved as
/// far.
pub fn to_extruded(
    positions: &[f64],
    measured: &[f64],
    offset: f64,
) -> Result<Vec<Option<f64>>, AlignError> {
    check(positions, measured, offset)?;
    let mut ahead = 0;
    let mut next = |position: f64| {
        let desired = position + offset;
        // Positions only grow, and so does the one that is searched.
        while positions.get(ahead).is_some_and(|there| *there < desired) {
            ahead += 1;
        }
        let (there, value) = (*positions.get(ahead)?, *measured.get(ahead)?);
        let bracket = ahead.checked_sub(1);
        let before = bracket.and_then(|k| Some((*positions.get(k)?, *measured.get(k)?)));
        match before {
            Some((here, was)) if there > here && there > desired => {
                Some(was + (value - was) * (desired - here) / (there - here))
            }
            _ => Some(value),
        }
    };
    Ok(positions.iter().map(|position| next(*position)).collect())
}

fn check(positions: &[f64], measured: &[f64], offset: f64) -> Result<(), AlignError> {
    if positions.len() != measured.len() {
        return Err(AlignError::Length { positions: positions.len(), measured: measured.len() });
    }
    if !(offset >= 0.0 && offset.is_finite()) {
        return Err(AlignError::Offset { offset });
    }
    let mut before = f64::NEG_INFINITY;
    for (at, &position) in (1..).zip(positions) {
        if !position.is_finite() {
            return Err(AlignError::NotFinite { at, position });
        }
        if position < before {
            return Err(AlignError::Falls { at, position, before });
        }
        before = position;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;

    #[test]
    fn the_thesis_example() {
        // Table 2: 10,000 clicks ahead of the sample lies between those at 0.235 s and 0.240 s.
        let positions = [0.0, 9_900.0, 10_100.0, 19_950.0, 20_150.0];
        let area = [1.0, 40.0, 44.0, 50.0, 58.0];
        let extruded = to_extruded(&positions, &area, 10_000.0).unwrap();
        assert_eq!(extruded[0], Some(42.0));
        // 19,900 lies between 10,100 and 19,950.
        assert!((extruded[1].unwrap() - (44.0 + 6.0 * 9_800.0 / 9_850.0)).abs() < 1e-12);
        assert_eq!(extruded[2], Some(50.0 + 8.0 * 150.0 / 200.0));
        assert_eq!(extruded[3..], [None, None]);
    }

    #[test]
    fn the_way_is_constant_where_the_time_is_not() {
        // A wheel whose speed doubles and halves; what passes the nozzle at the position p is
        // measured 30 mm later.
        let laid = |p: f64| 40.0 + 5.0 * (p / 25.0).sin();
        let mut positions = vec![0.0];
        for k in 0_u32..4000 {
            let speed = 30.0 + 15.0 * (f64::from(k) * 0.005).sin();
            positions.push(positions.last().unwrap() + speed * 0.005);
        }
        let measured: Vec<f64> = positions.iter().map(|p| laid(p - 30.0)).collect();
        let extruded = to_extruded(&positions, &measured, 30.0).unwrap();
        let end = positions.last().unwrap() - 30.0;
        for (position, value) in positions.iter().zip(extruded) {
            assert_eq!(value.is_none(), *position > end);
            assert!(value.is_none_or(|value| (value - laid(*position)).abs() < 1e-4));
        }
    }

    #[test]
    fn a_wheel_at_rest_gives_what_it_stopped_with() {
        let positions = [0.0, 1.0, 1.0, 1.0, 2.0, 3.0];
        let measured = [10.0, 20.0, 21.0, 22.0, 30.0, 40.0];
        let extruded = to_extruded(&positions, &measured, 1.0).unwrap();
        assert_eq!(
            extruded,
            [20.0, 30.0, 30.0, 30.0, 40.0].map(Some).into_iter().chain([None]).collect::<Vec<_>>()
        );
        assert_eq!(to_extruded(&positions[3..], &measured[3..], 0.0).unwrap()[0], Some(22.0));
    }

    #[test]
    fn what_cannot_be_aligned_is_refused() {
        let fell = to_extruded(&[0.0, 2.0, 1.0], &[0.0; 3], 1.0).unwrap_err();
        assert!(fell.to_string().contains("falls from 2 to 1 at sample 3"), "{fell}");
        assert!(matches!(to_extruded(&[0.0], &[], 1.0), Err(AlignError::Length { .. })));
        assert!(to_extruded(&[0.0], &[1.0], -1.0).is_err());
        assert!(to_extruded(&[f64::NAN], &[1.0], 1.0).is_err());
    }
}
