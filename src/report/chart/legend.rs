//! Legends that name only what is drawn.

use maud::{Markup, html};

use super::palette::{self, Ink};
use super::series::PlotCurve;
use super::strip::Strip;

/// Name, colour and kind of mark ("", "dash", "area", "block" or "dot").
pub type LegendEntry<'a> = (&'a str, Ink, &'a str);

/// A legend of all entries.
pub fn legend(entries: &[LegendEntry<'_>]) -> Markup {
    html! {
        div.legend { @for (name, ink, kind) in entries {
            @let property = if matches!(*kind, "" | "dash") { "border-color" } else { "background" };
            span { i class=(kind) style=(format!("{property}:{}", ink.css())) {} (name) }
        } }
    }
}

/// The entries whose series has points.
pub fn drawn<'a>(entries: &[(&PlotCurve, LegendEntry<'a>)]) -> Vec<LegendEntry<'a>> {
    let drawn = entries.iter().filter(|(series, _)| !series.is_empty());
    drawn.map(|(_, entry)| *entry).collect()
}

/// A legend of the states in a strip, and of the limit if one acted.
pub fn of_strips(names: &[&'static str], states: &Strip, limits: &Strip) -> Markup {
    let shown = |name: &str| states.segments().iter().any(|segment| segment.mark.name == name);
    let drawn = names.iter().filter(|name| shown(name));
    let mut entries: Vec<LegendEntry<'_>> =
        drawn.filter_map(|name| Some((*name, palette::state(name)?, "block"))).collect();
    if has_marks(limits) {
        entries.push(("a limit acts", palette::LIMIT, "block"));
    }
    legend(&entries)
}

/// Whether a strip has a mark with a severity above 0.
pub fn has_marks(strip: &Strip) -> bool {
    strip.segments().iter().any(|segment| segment.mark.severity > 0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::chart::strip::Mark;

    #[test]
    fn what_is_not_drawn_is_not_named() {
        let (mut some, none) = (PlotCurve::default(), PlotCurve::default());
        some.push(0.0, 1.0);
        let entry = |name| (name, palette::SPEED, "");
        let named = drawn(&[(&some, entry("robot")), (&none, entry("demand"))]);
        assert_eq!(named.iter().map(|entry| entry.0).collect::<Vec<_>>(), ["robot"]);
        let (mut states, mut limits) = (Strip::default(), Strip::default());
        states.push(0.0, Mark { severity: 1, name: "running" });
        limits.push(0.0, Mark { severity: 0, name: "none" });
        let names = ["off", "running", "fault"];
        let text = of_strips(&names, &states, &limits).into_string();
        assert!(text.contains("running") && !text.contains("fault"), "{text}");
        assert!(!text.contains("a limit acts"), "{text}");
        limits.push(1.0, Mark { severity: 1, name: "rise" });
        assert!(of_strips(&names, &states, &limits).into_string().contains("a limit acts"));
    }
}
