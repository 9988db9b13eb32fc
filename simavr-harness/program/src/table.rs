//! Lays out a table of modules for a terminal of any size, with as many columns of modules and as many fields
//! of each module as fit.

use terminal::{Style, pad_str, truncate_str};

/// The fields of a module, each with its style.
pub type Row = [(String, Style); FIELDS.len()];

/// The fields of a module: the name, and the width in characters. The last ones are left out if there is no
/// room.
pub const FIELDS: [(&str, usize); 5] =
    [("module", 7), ("type", 9), ("action", 11), ("hormone", 7), ("changes", 7)];

/// Between two modules side by side.
const GAP: &str = "   ";

/// The lines of a table of `number` modules, at most `width` characters wide and `height` lines high,
/// including the heading. `rows` makes the row of a module.
pub fn lay_out(number: usize, rows: impl Fn(usize) -> Row, width: usize, height: usize) -> Vec<String> {
    let fields = fields_within(width);
    let cell = widths(fields);
    let fit = ((width + GAP.len()) / (cell + GAP.len())).max(1);
    // The heading takes a line, and the number of modules that are left out another.
    let most = height.saturating_sub(1).max(1);
    let lines = number.div_ceil(fit).min(most);
    let is_whole = lines * fit >= number;
    let lines = if is_whole { lines } else { lines.saturating_sub(1) };
    let columns = number.min(lines * fit).div_ceil(lines.max(1));
    let plain = |text: &str| (text.to_owned(), Style::new().dim());
    let heading = render(&FIELDS.map(|(name, _)| plain(name)), fields);
    let mut table = vec![join(std::iter::repeat_n(heading, columns.max(1)), width)];
    for line in 0..lines {
        let modules = (0..columns).map(|column| column * lines + line).filter(|&module| module < number);
        table.push(join(modules.map(|module| render(&rows(module), fields)), width));
    }
    if !is_whole {
        table.push(truncate_str(&format!("... {} more", number - lines * columns), width, "").into_owned());
    }
    table
}

/// The number of fields of a module that fit into `width` characters.
fn fields_within(width: usize) -> usize {
    (1..=FIELDS.len()).rev().find(|&fields| widths(fields) <= width).unwrap_or(1)
}

fn widths(fields: usize) -> usize {
    FIELDS[..fields].iter().map(|(_, width)| width + 1).sum::<usize>() - 1
}

fn render(row: &Row, fields: usize) -> String {
    let cells = row[..fields].iter().zip(FIELDS).map(|((text, style), (_, width))| {
        let text = pad_str(text, width, terminal::Alignment::Left, Some(""));
        style.clone().for_stderr().apply_to(text).to_string()
    });
    cells.collect::<Vec<_>>().join(" ")
}

fn join(cells: impl Iterator<Item = String>, width: usize) -> String {
    let line = cells.collect::<Vec<_>>().join(GAP);
    truncate_str(&line, width, "").into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use terminal::measure_text_width;

    fn row(module: usize) -> Row {
        let text = [&format!("<{module}>"), "RightLeg", "HoldingOver", "A", "12345"];
        text.map(|text| (text.to_string(), Style::new()))
    }

    #[test]
    fn it_fits_any_terminal_and_shows_each_module_once_or_says_how_many_it_does_not() {
        for number in [0, 1, 2, 7, 100, 1000] {
            for width in (1..60).chain([79, 80, 93, 94, 200, 500]) {
                for height in [1, 2, 3, 10, 24, 80] {
                    let table = lay_out(number, row, width, height);
                    assert!(table.len() <= height.max(2), "{number} {width} {height}: {}", table.len());
                    assert!(table.iter().all(|line| measure_text_width(line) <= width), "{table:#?}");
                    if width < 20 {
                        continue; // numbers are cut off
                    }
                    let text = table.join("\n");
                    let shown = (0..number).filter(|module| text.contains(&format!("<{module}>"))).count();
                    assert_eq!(text.matches('<').count(), shown, "{text}");
                    let more = table.last().and_then(|last| last.strip_prefix("... ")?.strip_suffix(" more"));
                    let more = more.map_or(0, |more| more.parse().expect("a number"));
                    assert_eq!(shown + more, number, "{number} {width} {height}\n{text}");
                }
            }
        }
    }

    #[test]
    fn a_wide_terminal_shows_modules_side_by_side_and_a_narrow_one_less_of_each() {
        assert_eq!(lay_out(100, row, 250, 30).len(), 21);
        assert_eq!(lay_out(100, row, 80, 30).len(), 30);
        assert!(lay_out(3, row, 80, 30)[1].contains("12345"));
        let narrow = lay_out(3, row, 20, 30);
        assert_eq!(narrow[0].trim_end(), "module  type");
        assert_eq!(narrow.len(), 4);
    }
}
