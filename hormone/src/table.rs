//! A gait's table of rules, checked when it is compiled.
//!
//! Types, docks, letters and actions that do not exist are refused by the compiler as such. The rest is
//! checked here: [`gait!`](crate::gait!) runs [`check`] in a constant.

use tasks::dock::Dock;

use crate::data::{Data, MOST_BEATS};
use crate::module_type::ModuleType;
use crate::rule::Rule;

/// Refuses a table that makes no sense.
///
/// # Panics
/// When compiled, if `beats` is not 1 to [`MOST_BEATS`], a letter lies past the last beat, a rule is for
/// [`ModuleType::Other`], two rules are for one case, a rule with a condition has a letter for which there is
/// none without, or no type that can sit at a dock has a rule for the letter sent there.
pub const fn check(rules: &[Rule], beats: u8) {
    assert!(beats >= 1 && beats <= MOST_BEATS, "a Period has one to six beats");
    let mut index = 0;
    while index < rules.len() {
        let rule = &rules[index];
        assert!(
            !matches!(rule.case.module_type(), ModuleType::Other),
            "Other takes no rule: it keeps still and passes hormones on"
        );
        check_letters(rule, beats);
        let mut other = 0;
        while other < index {
            assert!(!is_one_case(rule, &rules[other], beats), "two rules for one case");
            other += 1;
        }
        check_otherwise(rule, rules, beats);
        check_receivers(rule, rules, beats);
        index += 1;
    }
}

const fn check_letters(rule: &Rule, beats: u8) {
    assert!(
        (rule.first as u8) < beats && (rule.last as u8) < beats,
        "a letter past the last beat of the Period"
    );
    if let Some(send) = rule.send {
        assert!((send.data as u8) < beats, "a letter past the last beat of the Period");
    }
}

const fn is_one_case(one: &Rule, other: &Rule, beats: u8) -> bool {
    one.case.is(other.case) && (one.covers(other.first, beats) || other.covers(one.first, beats))
}

/// A rule with a condition needs one without: a module that does not sense the condition has to do something.
const fn check_otherwise(rule: &Rule, rules: &[Rule], beats: u8) {
    let mut count = 0;
    while count < rule.beats(beats) {
        let data = rule.first.later(count, beats);
        let mut is_covered = false;
        let mut index = 0;
        while index < rules.len() {
            is_covered |= rules[index].case.is(rule.case.given(None)) && rules[index].covers(data, beats);
            index += 1;
        }
        assert!(is_covered, "a rule with a condition, and none for when it does not hold");
        count += 1;
    }
}

const fn check_receivers(rule: &Rule, rules: &[Rule], beats: u8) {
    let mut count = 0;
    while count < rule.beats(beats) {
        if let Some(send) = rule.sends(rule.first.later(count, beats), beats) {
            let mut index = 0;
            while index < Dock::ALL.len() {
                let dock = Dock::ALL[index];
                assert!(
                    !send.docks.contains(dock) || is_received(send.data, dock, rules, beats),
                    "a hormone that nobody receives"
                );
                index += 1;
            }
        }
        count += 1;
    }
}

/// Whether there is a rule for `data` in a module that can sit at its neighbour's `dock`.
const fn is_received(data: Data, dock: Dock, rules: &[Rule], beats: u8) -> bool {
    let mut index = 0;
    while index < rules.len() {
        let rule = &rules[index];
        if rule.case.is_received() && rule.case.module_type().sits_at(dock) && rule.covers(data, beats) {
            return true;
        }
        index += 1;
    }
    false
}
