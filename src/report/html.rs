//! The layout of every page: head, style sheet, title, verdict and footer. A page refers to no
//! other file.

use maud::{DOCTYPE, Markup, PreEscaped, Render, html};

use super::chart::palette;

/// A page from its content, without title and footer.
pub fn whole_page(title: &str, body: &Markup) -> Markup {
    reloading_page(title, None, body)
}

/// A page with a title, its content, and a footer that ends with `note`.
pub fn titled_page(title: &str, body: &Markup, note: &str) -> String {
    whole_page(title, &titled(title, body, note)).into_string()
}

/// Content with a title above it and a footer below it.
pub fn titled(title: &str, body: &Markup, note: &str) -> Markup {
    html! {
        h1 { (title) }
        (body)
        footer { "Written by truebead " (env!("CARGO_PKG_VERSION")) (note) }
    }
}

/// A page that reloads itself every `reload_s` seconds, or not at all for `None`.
pub fn reloading_page(title: &str, reload_s: Option<u32>, body: &Markup) -> Markup {
    let style = include_str!("style.css");
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                @if let Some(seconds) = reload_s {
                    meta http-equiv="refresh" content=(seconds);
                }
                title { (title) }
                style { (PreEscaped(palette::variables())) (PreEscaped(style)) }
            }
            body { main { (body) } }
        }
    }
}

/// The verdict on the subject of a page.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum VerdictLevel {
    /// Good.
    Good,
    /// Needs attention.
    Caution,
    /// Failed.
    Bad,
}

impl VerdictLevel {
    /// `Caution` if `is_cautious`, otherwise `Good`.
    pub const fn with_caution(is_cautious: bool) -> Self {
        if is_cautious { Self::Caution } else { Self::Good }
    }
}

/// The verdict of a page: its level in one word, sentences, and a list of warnings.
pub fn verdict(level: VerdictLevel, text: &impl Render, warnings: &[impl Render]) -> Markup {
    let (class, word) = match level {
        VerdictLevel::Good => ("good", "Good."),
        VerdictLevel::Caution => ("caution", "Look closer."),
        VerdictLevel::Bad => ("bad", "Failed."),
    };
    html! {
        div class={ "verdict " (class) } {
            b { (word) }
            (text)
            @if !warnings.is_empty() { ul { @for warning in warnings { li { (warning) } } } }
        }
    }
}

/// Names and values under a title.
pub fn about<N: Render, V: Render>(facts: impl IntoIterator<Item = (N, V)>) -> Markup {
    html! { div.about { @for (name, value) in facts { span { (name) " " b { (value) } } } } }
}

/// A number with `places` decimals; a dash for `None`.
pub fn number(value: Option<f64>, places: usize) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{value:.places$}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_verdict_has_its_level_and_its_warnings() {
        let warned = verdict(VerdictLevel::with_caution(true), &"Text.", &["a", "b"]);
        assert_eq!(
            warned.into_string(),
            "<div class=\"verdict caution\"><b>Look closer.</b>Text.\
             <ul><li>a</li><li>b</li></ul></div>"
        );
        let none: [&str; 0] = [];
        let good = verdict(VerdictLevel::with_caution(false), &"Text.", &none).into_string();
        assert!(good.contains("good") && !good.contains("<ul>"), "{good}");
    }
}
