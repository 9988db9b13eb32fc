//! Follows the hormones down a chain.

use std::collections::VecDeque;

use hormone::event::Event as Behaviour;
use hormone::hormone::Data;
use tasks::dock::Dock;

use crate::MILLISECOND;
use crate::chain::TraceEvent;

/// The time in which a hormone is delivered or given up: 21 transmissions, each with its wait for an ACK.
pub const HOP_AT_MOST: u64 = 250 * MILLISECOND;

/// The fates of the hormones sent from each module's Back to the Front of the next.
#[derive(Debug)]
pub struct Hormones {
    /// The hormones that have not been received yet, by the sending module: when each was sent, and its data.
    under_way: Vec<VecDeque<(u64, Data)>>,
    pub sent: usize,
    pub delivered: usize,
    /// Overtaken by a later one, or not received for [`HOP_AT_MOST`].
    pub lost: usize,
    /// Received without being sent, or twice.
    pub unsent: usize,
    /// The hormones that the last module received.
    pub at_tail: Vec<Data>,
}

impl Hormones {
    /// Follows the events of a chain of `modules` modules up to `now`.
    pub fn follow(modules: usize, trace_events: &[TraceEvent], now: u64) -> Self {
        let under_way = vec![VecDeque::new(); modules];
        let mut hormones =
            Hormones { under_way, sent: 0, delivered: 0, lost: 0, unsent: 0, at_tail: Vec::new() };
        for trace_event in trace_events {
            match trace_event.event {
                Behaviour::HormoneSent(Dock::Back, data) => {
                    hormones.sent += 1;
                    hormones.under_way[trace_event.module].push_back((trace_event.cycle, data));
                }
                Behaviour::HormoneReceived(Dock::Front, data) => hormones.receive(trace_event.module, data),
                Behaviour::HormoneDropped(Dock::Front) => hormones.drop(trace_event.module),
                Behaviour::HormoneSent(..)
                | Behaviour::HormoneReceived(..)
                | Behaviour::HormoneDropped(_) => {
                    panic!("{trace_event:?}: off the chain")
                }
                Behaviour::HormoneGenerated(_)
                | Behaviour::TopologyChanged(_)
                | Behaviour::ActionBegun(_)
                | Behaviour::MadeGood(_) => {}
            }
        }
        let overdue = |sent: &&(u64, Data)| sent.0 + HOP_AT_MOST < now;
        hormones.lost += hormones.under_way.iter().flatten().filter(overdue).count();
        hormones
    }

    /// A link keeps the order, so hormones that were sent before the received one are lost.
    fn receive(&mut self, module: usize, data: Data) {
        if module + 1 == self.under_way.len() {
            self.at_tail.push(data);
        }
        let under_way = &mut self.under_way[module - 1];
        match under_way.iter().position(|sent| sent.1 == data) {
            Some(skipped) => {
                under_way.drain(..=skipped);
                self.lost += skipped;
                self.delivered += 1;
            }
            None => self.unsent += 1,
        }
    }

    /// A hormone was received that was no news. Its data do not matter.
    fn drop(&mut self, module: usize) {
        match self.under_way[module - 1].pop_front() {
            Some(_) => self.delivered += 1,
            None => self.unsent += 1,
        }
    }

    /// # Panics
    /// When one of them was lost or came twice, when A and B do not alternate at the tail, or when it
    /// received fewer than `number`.
    pub fn assert_whole(&self, number: usize) {
        assert!(self.lost == 0 && self.unsent == 0, "{self:?}");
        assert!(self.at_tail.len() >= number, "{} hormones at the tail, not {number}", self.at_tail.len());
        assert!(self.at_tail.windows(2).all(|pair| pair[0] != pair[1]), "{:?}", self.at_tail);
    }
}
