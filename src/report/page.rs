//! The frame of every page: one file, no scripts, nothing fetched from anywhere.

use super::picture::Thumbnail;
use base64::{Engine, engine::general_purpose::STANDARD};
use maud::{DOCTYPE, Markup, PreEscaped, html};

const STYLE: &str = include_str!("page.css");

/// A whole page around `body`.
pub(super) fn page(title: &str, subtitle: &str, body: &Markup) -> String {
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) " - Weavelight" }
                style { (PreEscaped(STYLE)) }
            }
            body {
                header { h1 { (title) } p { (subtitle) } }
                main { (body) }
                footer { "Weavelight " (env!("CARGO_PKG_VERSION")) }
            }
        }
    }
    .into_string()
}

/// A picture with its caption; the picture is part of the page.
pub(super) fn figure(picture: &Thumbnail, caption: &str) -> Markup {
    let data = STANDARD.encode(picture.png());
    html! {
        figure {
            img src={"data:image/png;base64," (data)} width=(picture.width) height=(picture.height) alt=(caption);
            figcaption { (caption) }
        }
    }
}
