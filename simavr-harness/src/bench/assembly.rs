//! Counts the instructions of the kernel that are written in assembly, with all features and for all MCUs.

use super::Measured;

/// The sources with assembly. A test of the kernel checks that there are no others.
const SOURCES: [&str; 5] = [
    include_str!("../../../kernel/src/arch/avr/flash.rs"),
    include_str!("../../../kernel/src/arch/avr/interrupts.rs"),
    include_str!("../../../kernel/src/arch/avr/start.rs"),
    include_str!("../../../kernel/src/arch/avr/switch.rs"),
    include_str!("../../../kernel/src/arch/avr/vectors.rs"),
];

pub(super) fn measure() -> Measured {
    Measured::number("assembly_instructions", SOURCES.into_iter().map(instructions).sum())
}

/// Counts the instructions of a source, each a string literal on a line of its own, without planted faults.
fn instructions(source: &str) -> u64 {
    let lines = source.lines().map(str::trim);
    let behind = std::iter::once("").chain(lines.clone());
    lines.zip(behind).filter(|(line, before)| is_instruction(line) && !before.contains("fault-")).count()
        as u64
}

/// Whether a line is an instruction, not a label, a directive or another string.
fn is_instruction(line: &str) -> bool {
    let Some((text, rest)) = line.strip_prefix('"').and_then(|line| line.split_once('"')) else {
        return false;
    };
    let operation = text.split(' ').next().unwrap_or_default();
    let is_last = rest.is_empty() || rest.starts_with(',');
    is_last && !operation.is_empty() && operation.bytes().all(|byte| byte.is_ascii_lowercase())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_directives_and_other_strings_are_no_instructions() {
        for (line, is) in [
            ("\"push r28\",     // 2: Y", true),
            ("\"sei\",", true),
            ("\"reti\"", true),
            ("\"save:\",", false),
            ("\"1:\",", false),
            ("\".global kernel_switch\",", false),
            ("reason = \"other code jumps to them\"", false),
            ("// \"push r28\",", false),
        ] {
            assert_eq!(is_instruction(line), is, "{line}");
        }
        let source = "\"sei\",\n#[cfg(feature = \"fault-early-enable\")]\n\"cli\",";
        assert_eq!(instructions(source), 1);
    }
}
