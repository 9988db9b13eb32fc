//! A recording of a run as one HTML file, which plays without anything else: the page, the description of the
//! run as JSON, and the rest as bytes, compressed and in Base64. Or the same page for a run in progress,
//! which gets the same data in parts, as they come.

mod about;
mod pack;

use std::io::{self, Write};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::DeflateEncoder;
use serde::Serialize;
use simulation::Recording;

use about::{About, Part};

pub use about::{Block, Ground, Stair, Subject};

/// The page, which `./x page` makes from the sources in `page/`.
const PAGE: &str = include_str!("../page.html");

/// The end of the policy that lists what the page may fetch.
const POLICY: &str = "img-src data: blob:";

/// The mark in the page where the recording belongs.
const PLACE: &str = "<!-- recording -->";

/// The page that plays `recording` of this robot.
///
/// # Errors
/// Memory runs out.
pub fn page(subject: &Subject, recording: &Recording) -> io::Result<String> {
    let about = About::new(subject, recording.modules, recording.every);
    let mut compressed = DeflateEncoder::new(Vec::new(), Compression::best());
    compressed.write_all(&pack::pack(recording))?;
    let bytes = STANDARD.encode(compressed.finish()?);
    let elements = format!(
        "{}{}<script type=\"text/plain\" id=\"recording\">{bytes}</script>",
        element("about", &about)?,
        element("part", &Part::of(recording))?
    );
    Ok(PAGE.replacen(PLACE, &elements, 1))
}

/// The page that shows a run in progress, of a robot of so many modules, which is sampled every `every`
/// cycles. It asks its own server for [messages](message), and for nothing else.
///
/// # Errors
/// Memory runs out.
pub fn live_page(subject: &Subject, modules: usize, every: u64) -> io::Result<String> {
    let about = element("about", &About::new(subject, modules, every))?;
    Ok(PAGE.replacen(PLACE, &about, 1).replacen(POLICY, &format!("{POLICY}; connect-src 'self'"), 1))
}

/// The part of a run since the last message.
///
/// # Errors
/// Memory runs out.
pub fn news(recording: &Recording) -> io::Result<Vec<u8>> {
    message(&Part::of(recording), &pack::pack(recording))
}

/// A message to the page of a run in progress: two lengths of four bytes each, the lowest first, then JSON
/// and bytes of these lengths.
///
/// # Errors
/// Memory runs out.
pub fn message(json: &impl Serialize, bytes: &[u8]) -> io::Result<Vec<u8>> {
    let json = serde_json::to_vec(json)?;
    let mut message = Vec::with_capacity(8 + json.len() + bytes.len());
    for part in [&json[..], bytes] {
        let length = u32::try_from(part.len()).map_err(io::Error::other)?;
        message.extend(length.to_le_bytes());
    }
    message.extend(json);
    message.extend(bytes);
    Ok(message)
}

/// JSON as an element of the page. Nothing in it may end the element.
fn element(name: &str, content: &impl Serialize) -> io::Result<String> {
    let json = serde_json::to_string(content)?.replace('<', "\\u003c");
    Ok(format!("<script type=\"application/json\" id=\"{name}\">{json}</script>\n"))
}
