//! A recording of a run as one HTML file, which plays without anything else: the page, what is to be said of
//! the run as JSON, and the rest as [bytes](pack), compressed and in Base64.

mod about;
mod pack;

use std::io::{self, Write};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::DeflateEncoder;
use simulation::Recording;

use about::About;

pub use about::{Block, Ground, Stair, Subject};

/// The page, as `./x page` makes it of the sources in `page/`.
const PAGE: &str = include_str!("../page.html");

/// What stands in the page where the recording belongs.
const PLACE: &str = "<!-- recording -->";

/// The page that plays `recording`, of this robot.
///
/// # Errors
/// Memory runs out.
pub fn page(subject: &Subject, recording: &Recording) -> io::Result<String> {
    let about = serde_json::to_string(&About::new(subject, recording))?;
    let mut compressed = DeflateEncoder::new(Vec::new(), Compression::best());
    compressed.write_all(&pack::pack(recording))?;
    let bytes = STANDARD.encode(compressed.finish()?);
    // Nothing in it may end the element.
    let about = about.replace('<', "\\u003c");
    let elements = format!(
        "<script type=\"application/json\" id=\"about\">{about}</script>\n\
         <script type=\"text/plain\" id=\"recording\">{bytes}</script>"
    );
    Ok(PAGE.replacen(PLACE, &elements, 1))
}
