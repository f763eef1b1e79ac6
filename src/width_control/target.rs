//! The target width, along the path and by layer.

use crate::core::Mm;

/// The target width: constant, one for each layer, or a profile along the path of every
/// bead.
#[derive(Debug, Clone, PartialEq)]
pub struct WidthTarget {
    width: Mm,
    along: Vec<Knot>,
    layers: Option<Layers>,
}

/// A width at a position along the bead, linear in between. Two knots at one position are a
/// step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Knot {
    /// Path length from where the bead begins.
    pub path: Mm,
    /// Width.
    pub width: Mm,
}

/// A segment of the bead, by path length from where the bead begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeadSegment {
    /// Where it begins.
    pub from: Mm,
    /// Where it ends.
    pub to: Mm,
}

/// Layers, identified by the robot's z.
#[derive(Debug, Clone, PartialEq)]
pub struct Layers {
    /// The robot's z while it lays the first layer.
    pub first_z: Mm,
    /// Height of a layer.
    pub height: Mm,
    /// Width of each layer, the last one of all above; may be empty.
    pub widths: Vec<Mm>,
}

impl Layers {
    /// Number of the layer that is laid at a z, from 0.
    pub fn number(&self, z: Mm) -> usize {
        let number = ((z - self.first_z) / self.height).round().max(0.0);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "not negative, and saturates"
        )]
        let number = number as usize;
        number
    }

    fn width(&self, z: Mm) -> Option<Mm> {
        self.widths.get(self.number(z)).or(self.widths.last()).copied()
    }
}

impl WidthTarget {
    /// One width everywhere.
    pub const fn constant(width: Mm) -> Self {
        Self { width, along: Vec::new(), layers: None }
    }

    /// Adds a profile along every bead: knots in the order of the path. Before the first and after
    /// the last knot the width is constant.
    pub fn along(mut self, knots: Vec<Knot>) -> Self {
        self.along = knots;
        self
    }

    /// Adds layers.
    pub fn by_layer(mut self, layers: Layers) -> Self {
        self.layers = Some(layers);
        self
    }

    /// The width in the cell file.
    pub const fn nominal(&self) -> Mm {
        self.width
    }

    /// The knots of the profile along the path; empty where there is none.
    pub fn knots(&self) -> &[Knot] {
        &self.along
    }

    /// The layers, where there are any.
    pub const fn layers(&self) -> Option<&Layers> {
        self.layers.as_ref()
    }

    /// Whether the target is one width everywhere.
    pub fn is_constant(&self) -> bool {
        self.along.is_empty() && self.layers.as_ref().is_none_or(|layers| layers.widths.is_empty())
    }

    /// Width at a path length from where the bead begins, at the robot's z.
    pub fn at(&self, z: Mm, path: Mm) -> Mm {
        let of_layer = || self.layers.as_ref().and_then(|layers| layers.width(z));
        self.width_along(path).or_else(of_layer).unwrap_or(self.width)
    }

    /// Mean width over a segment of the bead.
    pub fn over(&self, z: Mm, segment: BeadSegment) -> Mm {
        let BeadSegment { from, to } = segment;
        let length = to - from;
        if self.along.is_empty() || length <= Mm::ZERO {
            return self.at(z, from);
        }
        let mut area = 0.0;
        let mut last = from;
        for position in self.along.iter().map(|knot| knot.path).filter(|at| from < *at && *at < to)
        {
            area += self.area(last, position);
            last = position;
        }
        area += self.area(last, to);
        Mm::new(area / length.get()).unwrap_or(self.width)
    }

    /// Area of a segment without a knot within it \[mm²\].
    fn area(&self, from: Mm, to: Mm) -> f64 {
        let middle = from + (to - from) * 0.5;
        self.width_along(middle).unwrap_or(self.width).get() * (to - from).get()
    }

    fn width_along(&self, path: Mm) -> Option<Mm> {
        let after = self.along.partition_point(|knot| knot.path <= path);
        let Some(next) = self.along.get(after) else {
            return self.along.last().map(|knot| knot.width);
        };
        let Some(before) = after.checked_sub(1).and_then(|at| self.along.get(at)) else {
            return Some(next.width);
        };
        let fraction = (path - before.path) / (next.path - before.path);
        Some(before.width + (next.width - before.width) * fraction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mm(value: f64) -> Mm {
        Mm::constant(value)
    }

    fn knot(path: f64, width: f64) -> Knot {
        Knot { path: mm(path), width: mm(width) }
    }

    fn stepped() -> WidthTarget {
        let knots = vec![knot(100.0, 42.0), knot(100.0, 40.0), knot(300.0, 44.0)];
        WidthTarget::constant(mm(42.0)).along(knots)
    }

    #[test]
    fn a_profile_steps_ramps_and_is_constant_at_its_ends() {
        let target = stepped();
        let at = |path| target.at(Mm::ZERO, mm(path)).get();
        assert_eq!((at(0.0), at(99.9)), (42.0, 42.0));
        assert_eq!((at(100.0), at(200.0), at(900.0)), (40.0, 42.0, 44.0));
    }

    #[test]
    fn the_mean_over_a_segment_is_that_of_its_pieces() {
        let target = stepped();
        let over =
            |from, to| target.over(Mm::ZERO, BeadSegment { from: mm(from), to: mm(to) }).get();
        assert!((over(90.0, 110.0) - 0.5 * (42.0 + 40.1)).abs() < 1e-9);
        assert!((over(250.0, 350.0) - 0.5 * (43.5 + 44.0)).abs() < 1e-9);
        assert_eq!(over(10.0, 10.0), 42.0);
    }

    #[test]
    fn layers_are_identified_by_z_and_the_last_width_holds_above() {
        let layers =
            Layers { first_z: mm(5.0), height: mm(20.0), widths: vec![mm(42.0), mm(40.0)] };
        let target = WidthTarget::constant(mm(44.0)).by_layer(layers);
        let at = |z| target.at(mm(z), Mm::ZERO).get();
        assert_eq!((at(0.0), at(6.0), at(24.0), at(400.0)), (42.0, 42.0, 40.0, 40.0));
        assert!(!target.is_constant());
    }
}
