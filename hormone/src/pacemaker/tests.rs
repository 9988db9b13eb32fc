use super::*;
use crate::gait::GaitName;
use Data::{A, B};

const BEAT: u16 = 500;

fn pacemaker(now: u16) -> Pacemaker {
    Pacemaker::new(GaitName::Centipede.gait(), now)
}

/// The hormone of a beat: of the first, or of the second.
fn cp(data: Data) -> Pace {
    nth(data as u16)
}

/// The hormone of a leader's beat: A and B in turn.
fn nth(beat: u16) -> Pace {
    let (data, number) = (if beat.is_multiple_of(2) { A } else { B }, beat as u8 % NUMBERS);
    Pace { name: 1, data, is_made_good: false, number, rhythm: 7, lifetime: None }
}

/// Hears a hormone that comes by the dock of those before.
fn hear(timer: &mut Pacemaker, hormone: Pace, now: u16) -> bool {
    timer.hear(hormone, true, now)
}

#[test]
fn a_leader_beats_evenly_however_the_clock_is_read_also_when_it_wraps() {
    for stride in [1_u32, 7, 33, 250, 499] {
        let start = 65_000_u16;
        let mut timer = pacemaker(start);
        let mut beats = Vec::new();
        for elapsed in (stride..=70_000).step_by(stride as usize) {
            beats.extend(timer.lead(start.wrapping_add(elapsed as u16)).map(|data| (elapsed, data)));
        }
        assert_eq!(beats.len() as u32, 70_000 / stride * stride / 500);
        for (number, (elapsed, data)) in (1_u32..).zip(beats) {
            assert!(
                (number * 500..number * 500 + stride).contains(&elapsed),
                "{elapsed} with stride {stride}"
            );
            assert_eq!(data, if number % 2 == 0 { A } else { B });
        }
    }
}

#[test]
fn until_beat_leads_to_the_beat() {
    let mut timer = pacemaker(0);
    assert_eq!(timer.until_beat(0), BEAT);
    assert_eq!(timer.until_beat(499), 1);
    assert_eq!(timer.lead(499), None);
    assert_eq!(timer.lead(500), Some(B));
    assert_eq!(timer.lead(500), None);
    assert_eq!(timer.until_beat(500), BEAT);
}

#[test]
fn beats_of_a_time_when_nobody_asked_are_passed_over_and_the_letters_stay_right() {
    let mut timer = pacemaker(0);
    assert_eq!(timer.lead(2_700), Some(B), "the fifth beat");
    assert_eq!(timer.until_beat(2_700), 300);
    timer.skip(63_100);
    assert_eq!(timer.lead(63_499), None);
    assert_eq!(timer.lead(63_500), Some(B), "the 127th");
}

#[test]
fn an_early_hormone_sets_the_timer_and_a_late_one_moves_it_a_millisecond() {
    let mut timer = pacemaker(0);
    assert!(hear(&mut timer, cp(A), 100));
    assert!(hear(&mut timer, cp(B), 560), "40 ms early");
    assert_eq!(timer.last(), (B, 560));
    assert!(hear(&mut timer, nth(2), 1_065));
    assert_eq!(timer.last(), (A, 1_061));
}

#[test]
fn a_beat_is_shortened_by_an_eighth_at_most() {
    let mut timer = pacemaker(0);
    assert!(hear(&mut timer, cp(A), 0));
    assert!(!hear(&mut timer, cp(B), 300), "200 ms early");
    let due = BEAT - BEAT / 8 + PATIENCE;
    assert_eq!(timer.until_overdue(300), Some(due - 300));
    assert_eq!(timer.make_good(due), Some(B));
    assert!(hear(&mut timer, nth(2), 2 * BEAT - 100), "38 ms early by now");
}

#[test]
fn what_comes_twice_is_news_once() {
    let mut timer = pacemaker(0);
    assert!(hear(&mut timer, cp(A), 0));
    assert!(!hear(&mut timer, cp(A), 3));
    assert!(!hear(&mut timer, cp(B), 4), "a beat that can't be yet");
    assert!(hear(&mut timer, cp(B), BEAT));
    assert!(!hear(&mut timer, cp(B), BEAT + 50));
    assert!(!hear(&mut timer, cp(A), BEAT + 50), "that of the beat before");
}

#[test]
fn beats_are_made_good_after_the_patience_and_late_hormones_are_no_news() {
    let mut timer = pacemaker(0);
    assert_eq!(timer.make_good(60_000), None, "no rhythm yet");
    assert_eq!(timer.until_overdue(0), None);
    assert!(hear(&mut timer, cp(A), 0));
    assert_eq!(timer.until_overdue(0), Some(BEAT + PATIENCE));
    assert_eq!(timer.make_good(BEAT + PATIENCE - 1), None);
    assert_eq!(timer.make_good(BEAT + PATIENCE), Some(B));
    assert_eq!(timer.last(), (B, BEAT));
    assert!(!hear(&mut timer, cp(B), BEAT + 140));
    assert_eq!(timer.last(), (B, BEAT + 1));
    assert!(hear(&mut timer, nth(2), 2 * BEAT));
}

#[test]
fn the_rhythm_is_forgotten_after_so_many_beats_and_each_hormone_renews_it() {
    let mut timer = pacemaker(0);
    assert!(hear(&mut timer, cp(A), 0));
    for round in 0..4 {
        let start = round * 6 * BEAT;
        for beat in 1..6 {
            assert!(timer.make_good(start + beat * BEAT + PATIENCE).is_some());
        }
        assert!(hear(&mut timer, cp(A), start + 6 * BEAT));
    }
    let last = 24 * BEAT;
    let made_good = (1..20).filter(|beat| timer.make_good(last + beat * BEAT + PATIENCE).is_some()).count();
    assert_eq!(made_good, usize::from(MOST_MISSED));
    assert!(!timer.is_following());
    assert!(hear(&mut timer, cp(B), last + 30 * BEAT), "any hormone starts afresh");
}

#[test]
fn a_hormone_out_of_beat_is_taken_up_once_nothing_in_beat_comes() {
    let mut timer = pacemaker(0);
    assert!(hear(&mut timer, cp(A), 0));
    let other = Pace { number: 5, ..cp(B) };
    assert!(!hear(&mut timer, other, 100), "none of this beat, nor of the next");
    assert_eq!(timer.make_good(BEAT + PATIENCE), Some(B));
    assert!(hear(&mut timer, other, 600));
    assert_eq!(timer.last(), (B, 600));
    assert!(hear(&mut timer, Pace { number: 6, ..cp(A) }, 600 + BEAT), "it counts on from there");
}

#[test]
fn a_beat_made_good_is_not_taken_again_by_another_rhythm() {
    let mut timer = pacemaker(0);
    assert!(hear(&mut timer, cp(A), 0));
    assert_eq!(timer.make_good(BEAT + PATIENCE), Some(B));
    let other = Pace { rhythm: 8, ..cp(B) };
    assert!(!hear(&mut timer, other, BEAT + PATIENCE + 8));
    assert_eq!(timer.last(), (B, BEAT + 1));
    assert!(hear(&mut timer, Pace { rhythm: 8, ..nth(2) }, 2 * BEAT), "it follows that one from now on");
}

#[test]
fn a_beat_made_good_is_corrected_once_by_who_knows_better() {
    let mut timer = pacemaker(0);
    assert!(hear(&mut timer, cp(A), 0));
    assert!(!hear(&mut timer, Pace { data: B, ..cp(A) }, 40), "the leader's own beat is right");
    assert_eq!(timer.make_good(BEAT + PATIENCE), Some(B));
    let better = Pace { data: A, is_made_good: true, ..cp(B) };
    assert!(hear(&mut timer, better, 600));
    assert_eq!(timer.last(), (A, BEAT), "it says which beat it was, not when");
    assert!(!hear(&mut timer, Pace { data: B, ..better }, 605), "else two could race round a loop");
    assert_eq!(timer.make_good(2 * BEAT + PATIENCE), Some(B));
}

/// The module that the rhythm comes from has been without a leader, and follows one now that is a beat
/// behind.
#[test]
fn a_beat_made_good_gives_way_once_to_a_rhythm_that_counts_otherwise() {
    let made_good = |number, data, rhythm| Pace { number, rhythm, is_made_good: true, ..cp(data) };
    let mut timer = pacemaker(0);
    assert!(hear(&mut timer, cp(A), 0));
    assert_eq!(timer.make_good(BEAT + PATIENCE), Some(B));
    assert!(!hear(&mut timer, made_good(1, B, 7), 515));
    assert!(hear(&mut timer, made_good(0, A, 8), 545), "else it gets on by one module a beat");
    assert_eq!((timer.rhythm(), timer.last()), (8, (A, 545)));
    assert!(!hear(&mut timer, made_good(7, B, 9), 560), "else hormones could race round a loop");
    assert!(hear(&mut timer, made_good(1, B, 8), 545 + BEAT));

    let in_ring = |pace| Pace { lifetime: core::num::NonZeroU16::new(9), ..pace };
    let mut timer = pacemaker(0);
    assert!(hear(&mut timer, in_ring(cp(A)), 0));
    assert_eq!(timer.make_good(BEAT + PATIENCE), Some(B));
    assert!(!hear(&mut timer, in_ring(made_good(1, B, 7)), 515));
    assert!(!hear(&mut timer, in_ring(made_good(0, A, 8)), 545), "another leader's, at its own time");
}

#[test]
fn another_rhythm_is_taken_up_at_once_on_the_same_way_and_after_a_silence_on_another() {
    let other = Pace { rhythm: 8, number: 3, ..cp(A) };
    let mut timer = pacemaker(0);
    assert!(hear(&mut timer, cp(A), 0));
    assert!(!timer.hear(other, false, 100));
    assert!(!timer.hear(other, true, BEAT / 4 - 1), "it may have gone round a loop");
    assert!(!timer.hear(other, false, 400));
    assert!(!timer.hear(Pace { rhythm: 8, ..cp(A) }, true, 401), "so may this, however long that takes");
    assert!(timer.hear(other, true, 401));
    assert_eq!((timer.rhythm(), timer.last()), (8, (A, 401)));
    assert_eq!(timer.make_good(401 + BEAT + PATIENCE), Some(B));
    assert!(!timer.hear(cp(A), false, 950), "that one may be lost, or late");
    assert_eq!(timer.make_good(401 + 2 * BEAT + PATIENCE), Some(A));
    assert!(!timer.hear(cp(A), false, 1_450), "and one late");
    assert_eq!(timer.make_good(401 + 3 * BEAT + PATIENCE), Some(B));
    assert!(timer.hear(cp(A), false, 1_950));
}

/// Two ways lead from one leader, one of them through a branch more. Their hormones come within a millisecond
/// of each other; chance decides which one is first, or lost.
#[test]
fn where_there_are_two_ways_the_first_one_is_kept() {
    let mut random = 1_u16;
    let mut draw = || {
        random = random.wrapping_mul(25_173).wrapping_add(13_849);
        random >> 8
    };
    let mut timer = pacemaker(0);
    assert!(timer.hear(cp(A), true, 0));
    let mut before = A;
    for beat in 1..10_000_u16 {
        let (at, own) = (beat.wrapping_mul(BEAT), nth(beat));
        let other = Pace { data: own.data.later(1, 2), rhythm: 8, ..own };
        let [first, is_late, is_lost] = [draw() % 2 == 0, draw() % 8 == 0, draw() % 8 == 0 && beat % 2 == 0];
        if first {
            assert!(!timer.hear(other, false, at.wrapping_sub(1)));
        }
        if !is_late && !is_lost {
            timer.hear(own, true, at);
        }
        assert!(!timer.hear(other, false, at.wrapping_add(1)));
        // A late one has moved the timer by a millisecond.
        timer.make_good(at.wrapping_add(PATIENCE + 10));
        assert!(!timer.hear(other, false, at.wrapping_add(40)));
        if is_late && !is_lost {
            timer.hear(own, true, at.wrapping_add(60));
        }
        assert_eq!(timer.last().0, before.later(1, 2), "beat {beat}");
        before = timer.last().0;
    }
}

/// What comes by the first way may be the module's own, back round a loop.
#[test]
fn where_one_way_brings_no_beat_of_a_leader_the_other_is_followed_in_the_end() {
    let made_good = |beat| Pace { is_made_good: true, ..nth(beat) };
    let leaders = |beat| Pace { rhythm: 9, ..nth(beat) };
    let mut timer = pacemaker(0);
    assert!(hear(&mut timer, nth(0), 0));
    for beat in 1..=u16::from(MOST_MISSED) + 2 {
        // A leader's own beat by the first way counts anew.
        let first = if beat == 2 { nth(beat) } else { made_good(beat) };
        let is_last = beat == u16::from(MOST_MISSED) + 2;
        assert!(!timer.hear(leaders(beat + 1), false, beat * BEAT - 200), "beat {beat}");
        assert!(hear(&mut timer, first, beat * BEAT));
        assert!(!timer.hear(made_good(beat), false, beat * BEAT + 10));
        if is_last {
            assert!(timer.hear(leaders(beat + 1), false, beat * BEAT + 300));
        }
    }
}

#[test]
fn another_gait_is_another_rhythm() {
    let mut timer = pacemaker(0);
    assert!(hear(&mut timer, cp(A), 0));
    let wave = Pace { name: 2, ..cp(B) };
    assert!(!timer.change(GaitName::Caterpillar.gait(), wave, false, 10));
    assert!(
        !timer.change(GaitName::Caterpillar.gait(), wave, true, BEAT / 4 - 1),
        "it may have gone round a loop"
    );
    assert!(timer.change(GaitName::Caterpillar.gait(), wave, true, BEAT / 4));
    assert_eq!(timer.until_overdue(BEAT / 4), Some(200 + PATIENCE));
}

#[test]
fn another_leader_whose_rhythm_is_the_same_by_chance_is_taken_up_at_once() {
    for number in [0, 7, 3] {
        let mut timer = pacemaker(0);
        assert!(hear(&mut timer, cp(A), 0));
        assert!(hear(&mut timer, Pace { number, ..cp(B) }, 439), "{number}");
        assert_eq!(timer.last(), (B, 439));
    }
}
