//! The decisions of HORMONE, the hormone-inspired controller of the paper's Figure 5: which action to
//! perform and which hormone to propagate, from the topology, the local timer and the received
//! hormone.

use core::num::NonZeroU16;

use kernel::flash::Flash;
use tasks::dock::{Dock, DockSet};

use crate::action::Action;
use crate::hormone::Hormone;
use crate::local_timer::{LocalTimer, Phase};
use crate::module_type::ModuleType;
use crate::rule::{Outgoing, Rule, Trigger};
use crate::status::Status;
use crate::time::until;
use crate::topology::{NO_NEIGHBOUR, Neighbours, to_bytes};

const ALL_DOCKS: DockSet = DockSet::of(&Dock::ALL);

/// What HORMONE has to do after an input.
#[derive(Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_arch = "avr"), derive(Debug))]
pub struct Response {
    /// The action to perform from now on.
    pub action: Action,
    /// The hormone to send, through docks that have a neighbour; at least one.
    pub send: Option<Outgoing>,
}

/// The state of HORMONE, driven by a table of `N` rules.
///
/// A module whose type no rule covers keeps still. One of type [`ModuleType::Other`] besides passes a
/// hormone on, unchanged, to all its neighbours but the one it came from, so that a robot of an
/// unknown shape is not cut off behind it.
pub struct Controller<const N: usize> {
    rules: &'static Flash<[Rule; N]>,
    timer: LocalTimer,
    status: Status,
}

impl<const N: usize> Controller<N> {
    /// A module at power-up, at `now`. `period` is in milliseconds, at most 32 767.
    pub const fn new(rules: &'static Flash<[Rule; N]>, period: NonZeroU16, now: u16) -> Self {
        Controller { rules, timer: LocalTimer::new(period, now), status: Status::POWER_UP }
    }

    /// The module's neighbours are now these. A module that changes its type rests until the rules of
    /// its new type speak.
    pub fn topology(&mut self, neighbours: &Neighbours, now: u16) -> Response {
        let module_type = ModuleType::of(neighbours);
        if module_type != self.status.module_type {
            self.status.module_type = module_type;
            self.status.action = Action::Rest;
            // Else a new head would take up what the timer came by while it was none.
            self.timer.advance(now);
        }
        self.status.neighbours = to_bytes(neighbours);
        self.status.topology_changes = self.status.topology_changes.wrapping_add(1);
        self.respond(None)
    }

    /// The local timer is to be looked at: after [`next_due`](Self::next_due), or at any other time. A
    /// caller late by half a Period skips a beat and does not make up for it.
    pub fn timer(&mut self, now: u16) -> Option<Response> {
        self.timer.advance(now);
        let timer = &self.timer;
        let rule = self.rule(|trigger| matches!(trigger, Trigger::Timer(phase) if timer.passed(phase)))?;
        if let Some(outgoing) = rule.send {
            self.status.hormone = outgoing.hormone.data as u8;
        }
        Some(self.perform(rule))
    }

    /// Milliseconds from `now` until [`timer`](Self::timer) is to be called; `None` while no rule of
    /// the module's type waits for the timer.
    pub fn next_due(&self, now: u16) -> Option<u16> {
        self.rules_of_type()
            .filter_map(|rule| match rule.trigger {
                Trigger::Timer(phase) => Some(self.due_at(phase)),
                Trigger::Received(_) => None,
            })
            .map(|due| until(due, now))
            .min()
    }

    /// `hormone` came in by `dock`.
    pub fn received(&mut self, dock: Dock, hormone: Hormone) -> Response {
        self.status.hormones_received = self.status.hormones_received.wrapping_add(1);
        self.status.hormone = hormone.data as u8;
        match self.rule(|trigger| trigger == Trigger::Received(hormone)) {
            Some(rule) => self.perform(rule),
            None if self.status.module_type == ModuleType::Other => {
                let mut docks = ALL_DOCKS;
                docks.remove(dock);
                self.respond(Some(Outgoing { hormone, docks }))
            }
            None => self.respond(None),
        }
    }

    /// Counts a message to HORMONE that could not be read.
    pub fn malformed(&mut self) {
        self.status.malformed = self.status.malformed.wrapping_add(1);
    }

    /// Counts a hormone message handed to a link.
    pub fn sent(&mut self) {
        self.status.hormones_sent = self.status.hormones_sent.wrapping_add(1);
    }

    /// Counts a hormone message that found no room.
    pub fn unsent(&mut self) {
        self.status.hormones_unsent = self.status.hormones_unsent.wrapping_add(1);
    }

    /// The module as it can be seen from outside.
    pub fn status(&self) -> &Status {
        &self.status
    }

    fn perform(&mut self, rule: Rule) -> Response {
        self.status.action = rule.action;
        self.respond(rule.send)
    }

    /// The current action, and what of `send` can leave.
    fn respond(&self, send: Option<Outgoing>) -> Response {
        let send = send
            .map(|outgoing| Outgoing { docks: self.connected(outgoing.docks), ..outgoing })
            .filter(|outgoing| !outgoing.docks.is_empty());
        Response { action: self.status.action, send }
    }

    /// The first rule of the module's type whose trigger is the one asked for.
    fn rule(&self, is_triggered: impl Fn(Trigger) -> bool) -> Option<Rule> {
        self.rules_of_type().find(|rule| is_triggered(rule.trigger))
    }

    fn rules_of_type(&self) -> impl Iterator<Item = Rule> {
        self.rules.iter().filter(|rule| rule.module_type == self.status.module_type)
    }

    fn due_at(&self, phase: Phase) -> u16 {
        self.timer.read_at().wrapping_add(self.timer.until(phase))
    }

    /// Those of `docks` that have a neighbour.
    fn connected(&self, docks: DockSet) -> DockSet {
        let mut connected = DockSet::EMPTY;
        for dock in docks.iter() {
            let neighbour = self.status.neighbours.get(usize::from(dock.index()));
            if neighbour.is_some_and(|&neighbour| neighbour != NO_NEIGHBOUR) {
                connected.insert(dock);
            }
        }
        connected
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gait::centipede;
    use crate::hormone::{Data, HormoneName};
    use Dock::{Back, Down, Front, Left, Right, Up};

    const A: Hormone = Hormone { name: HormoneName::CP, data: Data::A };
    const B: Hormone = Hormone { name: HormoneName::CP, data: Data::B };

    const HEAD: Neighbours = [None, Some(Front), None, None, None, None];
    const TAIL: Neighbours = [Some(Back), None, None, None, None, None];
    const LEFT_LEG: Neighbours = [None, Some(Left), None, None, None, None];
    const RIGHT_LEG: Neighbours = [None, Some(Right), None, None, None, None];
    const SPINE: Neighbours = [Some(Back), Some(Front), None, None, None, None];
    const BRANCH: Neighbours = [Some(Back), Some(Front), Some(Back), Some(Back), None, None];
    /// A spine with one leg, and something on top.
    const OTHER: Neighbours = [Some(Back), Some(Front), None, Some(Back), Some(Down), None];

    fn module(neighbours: &Neighbours) -> Controller<10> {
        let mut controller = Controller::new(&centipede::RULES, centipede::PERIOD, 0);
        controller.topology(neighbours, 0);
        controller
    }

    fn sends(hormone: Hormone, docks: &[Dock]) -> Option<Outgoing> {
        Some(Outgoing { hormone, docks: DockSet::of(docks) })
    }

    #[test]
    fn each_type_answers_a_and_b_as_the_text_says() {
        use Action::{Holding, Rest, Straight, Swing};
        let body = &[Left, Right, Back];
        let rows = [
            (SPINE, [(Straight, sends(A, &[Back])), (Straight, sends(B, &[Back]))]),
            (BRANCH, [(Straight, sends(B, body)), (Straight, sends(A, body))]),
            (LEFT_LEG, [(Swing, None), (Holding, None)]),
            (RIGHT_LEG, [(Holding, None), (Swing, None)]),
            (TAIL, [(Rest, None), (Rest, None)]),
            (HEAD, [(Rest, None), (Rest, None)]),
        ];
        for (neighbours, answers) in rows {
            let mut controller = module(&neighbours);
            for (hormone, (action, send)) in [A, B].into_iter().zip(answers) {
                assert_eq!(controller.received(Front, hormone), Response { action, send });
                assert_eq!(controller.status().hormone(), Some(hormone.data));
            }
            assert_eq!(controller.status().hormones_received, 2);
        }
    }

    #[test]
    fn the_head_beats_a_at_0_and_b_at_half_a_period() {
        let mut head = module(&HEAD);
        for beat in 1..=200_u16 {
            let wait = head.next_due((beat - 1).wrapping_mul(500));
            assert_eq!(wait, Some(500));
            let now = beat.wrapping_mul(500);
            assert_eq!(head.timer(now.wrapping_sub(1)), None);
            let hormone = if beat % 2 == 0 { A } else { B };
            let send = sends(hormone, &[Back]);
            assert_eq!(head.timer(now), Some(Response { action: Action::Straight, send }));
            assert_eq!(head.timer(now), None);
            assert_eq!(head.status().hormone(), Some(hormone.data));
        }
    }

    #[test]
    fn only_a_head_waits_for_the_timer() {
        for neighbours in [TAIL, LEFT_LEG, RIGHT_LEG, SPINE, BRANCH, OTHER] {
            let mut controller = module(&neighbours);
            assert_eq!(controller.next_due(0), None);
            assert_eq!(controller.timer(500), None);
        }
    }

    #[test]
    fn a_new_head_does_not_take_up_a_beat_from_before() {
        let mut controller = module(&SPINE);
        assert_eq!(controller.topology(&HEAD, 30_700).send, None);
        assert_eq!(controller.timer(30_700), None);
        assert_eq!(controller.next_due(30_700), Some(300));
    }

    #[test]
    fn a_head_keeps_its_beat_through_a_flicker() {
        let mut controller = module(&HEAD);
        controller.topology(&[None; 6], 510);
        controller.topology(&HEAD, 800);
        assert_eq!(controller.timer(1000).unwrap().send, sends(A, &[Back]));
    }

    #[test]
    fn a_head_told_that_it_still_is_one_misses_no_beat() {
        let mut controller = module(&HEAD);
        controller.topology(&HEAD, 500);
        assert_eq!(controller.timer(500).unwrap().send, sends(B, &[Back]));
    }

    #[test]
    fn the_unknown_keeps_still_and_passes_on_to_all_others() {
        let mut controller = module(&OTHER);
        for (from, others) in [(Front, [Back, Right, Up]), (Right, [Front, Back, Up])] {
            let response = controller.received(from, B);
            assert_eq!(response, Response { action: Action::Rest, send: sends(B, &others) });
        }
        let mut alone = module(&[None; 6]);
        assert_eq!(alone.received(Front, A), Response { action: Action::Rest, send: None });
    }

    #[test]
    fn another_type_rests_until_told() {
        let mut controller = module(&LEFT_LEG);
        assert_eq!(controller.received(Back, A).action, Action::Swing);
        assert_eq!(controller.topology(&LEFT_LEG, 10).action, Action::Swing);
        assert_eq!(controller.topology(&RIGHT_LEG, 20).action, Action::Rest);
        assert_eq!(controller.received(Back, A).action, Action::Holding);
    }

    #[test]
    fn the_status_shows_and_counts() {
        let mut controller = Controller::new(&centipede::RULES, centipede::PERIOD, 0);
        assert_eq!(*controller.status(), Status::POWER_UP);
        controller.topology(&LEFT_LEG, 0);
        controller.received(Back, A);
        controller.received(Back, B);
        controller.received(Back, A);
        controller.malformed();
        controller.malformed();
        controller.sent();
        controller.unsent();
        let seen = Status {
            hormones_received: 3,
            hormones_sent: 1,
            topology_changes: 1,
            malformed: 2,
            hormones_unsent: 1,
            neighbours: to_bytes(&LEFT_LEG),
            module_type: ModuleType::LeftLeg,
            hormone: Data::A as u8,
            action: Action::Swing,
        };
        assert_eq!(*controller.status(), seen);
    }
}
