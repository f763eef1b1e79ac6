//! The frame of every page: a head with its style sheet, which needs nothing but itself.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::chart::palette;

/// A page that needs nothing but itself, around its content.
pub fn whole_page(title: &str, body: &Markup) -> Markup {
    reloading_page(title, None, body)
}

/// The same; with a number of seconds after which it loads itself anew.
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
