//! Makes plots light or dark like the page that shows them.

use std::error::Error;

/// The style by which a dark page replaces a plot's white, black and colours.
const DARK: &str = r##"<style>@media (prefers-color-scheme: dark) {
[fill="#FFFFFF"] { fill: #0d1117 } [fill="#000000"] { fill: #e6edf3 } [stroke="#000000"] { stroke: #8c959f }
[fill="#0969DA"] { fill: #58a6ff } [stroke="#0969DA"] { stroke: #58a6ff }
[fill="#CF222E"] { fill: #ff7b72 } [stroke="#CF222E"] { stroke: #ff7b72 }
[fill="#1A7F37"] { fill: #56d364 } [stroke="#1A7F37"] { stroke: #56d364 }
[fill="#8250DF"] { fill: #bc8cff } [stroke="#8250DF"] { stroke: #bc8cff }
[fill="#9A6700"] { fill: #e3b341 } [stroke="#9A6700"] { stroke: #e3b341 }
[fill="#57606A"] { fill: #8b949e } [stroke="#57606A"] { stroke: #8b949e } }</style>
"##;

/// Adds the style for dark pages to a plot.
///
/// # Errors
/// The plot is empty.
pub fn for_any_page(mut svg: String) -> Result<String, Box<dyn Error>> {
    let begin = svg.find("<rect").ok_or("the plot is empty")?;
    svg.insert_str(begin, DARK);
    Ok(svg)
}
