//! The two-wire bus that joins MCUs (chapter "Two-wire Serial Interface" of the datasheet). It decides which
//! node is master, which is addressed, and which status each node gets at the end of each byte.
//!
//! The bus acts at cycles that it knows beforehand: a START, a repeated START and a STOP take one bit, a
//! byte nine. The nodes run up to such a cycle and none runs past it, so the bus sees the state of all nodes
//! at that cycle, however far apart they ran before.
//!
//! Two simplifications. A node that leaves in mid-transfer releases both wires at once; the nodes that it
//! addressed learn of it at the next START, as a bus error if a byte was under way. And a node that makes its
//! bits shorter goes on with the longer ones for ten bits: the others may have run ahead as far by then.

use std::num::NonZeroU32;

use crate::cpu::News;
use crate::mcu::Mcu;
use crate::repair::twi::{BYTE_BITS, Command, START_AND_ADDRESS_BITS};
use crate::trace::{BusSignal, Slice};

/// Status codes (tables "Status Codes for Master Transmitter Mode" and following).
mod status {
    pub const BUS_ERROR: u8 = 0x00;
    pub const START: u8 = 0x08;
    pub const REPEATED_START: u8 = 0x10;
    pub const ARBITRATION_LOST: u8 = 0x38;

    /// To the master, by whether a slave acknowledged.
    pub const fn address_written(acknowledged: bool) -> u8 {
        if acknowledged { 0x18 } else { 0x20 }
    }
    pub const fn address_read(acknowledged: bool) -> u8 {
        if acknowledged { 0x40 } else { 0x48 }
    }
    pub const fn data_sent(acknowledged: bool) -> u8 {
        if acknowledged { 0x28 } else { 0x30 }
    }
    /// By whether the master itself acknowledged.
    pub const fn data_received(acknowledged: bool) -> u8 {
        if acknowledged { 0x50 } else { 0x58 }
    }

    /// To a slave, by whether it lost arbitration as a master in the same byte.
    pub const fn addressed_to_read(lost: bool) -> u8 {
        if lost { 0xb0 } else { 0xa8 }
    }
    pub const fn addressed_to_write(general_call: bool, lost: bool) -> u8 {
        match (general_call, lost) {
            (false, false) => 0x60,
            (false, true) => 0x68,
            (true, false) => 0x70,
            (true, true) => 0x78,
        }
    }
    /// By whether the slave itself acknowledged.
    pub const fn slave_received(general_call: bool, acknowledged: bool) -> u8 {
        match (general_call, acknowledged) {
            (false, true) => 0x80,
            (false, false) => 0x88,
            (true, true) => 0x90,
            (true, false) => 0x98,
        }
    }
    pub const STOP_OR_REPEATED_START: u8 = 0xa0;
    pub const SLAVE_SENT: u8 = 0xb8;
    pub const SLAVE_SENT_AND_REFUSED: u8 = 0xc0;
    pub const SLAVE_SENT_LAST: u8 = 0xc8;
}

/// A bus and the roles of its nodes. The nodes are MCUs, always given in the same order.
pub struct Bus {
    roles: Vec<Role>,
    phase: Phase,
    /// What the next byte is.
    next: NextByte,
    /// While something holds SDA low: the pulses on SCL until it releases SDA.
    data_held_for: u32,
    /// The cycle at which the clock was released last.
    released: u64,
    /// Length of a bit on the wires, in cycles.
    bit: u64,
    /// The first cycle at which a node leaves, if the bus has yet to act on it.
    departure: Option<u64>,
    /// The shortest bit of any node, in cycles.
    shortest_bit: u64,
    counts: BusCounts,
    /// The signals on the wires, if they are recorded.
    signals: Option<Vec<Slice<BusSignal>>>,
}

/// What a bus has carried since power-up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BusCounts {
    /// Bytes, addresses included.
    pub bytes: u64,
    /// Masters that lost arbitration.
    pub arbitrations_lost: u64,
    /// Transfers that ended because the master left the bus.
    pub abandoned: u64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Role {
    None,
    Master,
    Slave { general_call: bool },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// There is no master since this cycle. `in_byte`: the last one left within a byte.
    Free {
        since: u64,
        in_byte: bool,
    },
    /// A START is being sent.
    Start {
        since: u64,
        in_byte: bool,
        due: u64,
    },
    /// The clock is held low: a program has to answer first.
    Held,
    RepeatedStart {
        due: u64,
    },
    Byte {
        due: u64,
    },
    Stop {
        due: u64,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum NextByte {
    Address,
    Written,
    Read,
}

impl Bus {
    /// A free bus that joins `nodes` MCUs.
    pub fn new(nodes: usize) -> Self {
        Self {
            roles: vec![Role::None; nodes],
            phase: Phase::Free { since: 0, in_byte: false },
            next: NextByte::Address,
            data_held_for: 0,
            released: 0,
            bit: 0,
            departure: None,
            shortest_bit: 0,
            counts: BusCounts::default(),
            signals: None,
        }
    }

    /// Records the signals on the wires from now on.
    pub(crate) fn trace(&mut self) {
        self.signals = Some(Vec::new());
    }

    /// Ends the recording and returns the signals, in order.
    pub(crate) fn take_signals(&mut self) -> Vec<Slice<BusSignal>> {
        self.signals.take().unwrap_or_default()
    }

    fn note(&mut self, end: u64, bits: u64, what: BusSignal) {
        let bit = self.bit;
        if let Some(signals) = &mut self.signals {
            signals.push(Slice { begin: end - bits * bit, end, what });
        }
    }

    pub fn counts(&self) -> BusCounts {
        self.counts
    }

    /// Holds SDA low until the bus has seen `clocks` pulses on SCL, as a slave that lost count does. A master
    /// that sends loses the bus, a STOP has no effect, and no START is possible.
    pub(crate) fn hold_data(&mut self, nodes: &mut [Mcu], clocks: NonZeroU32) {
        self.data_held_for = clocks.get();
        for node in nodes {
            node.take_clock_pulses();
            node.set_data_wire(false);
        }
    }

    /// Releases SDA after the last of the pulses. SCL is high then, so all nodes see a STOP.
    fn see_clock_pulses(&mut self, nodes: &mut [Mcu]) {
        if self.data_held_for == 0 {
            return;
        }
        let pulses = nodes.iter_mut().map(Mcu::take_clock_pulses).sum();
        self.data_held_for = self.data_held_for.saturating_sub(pulses);
        if self.data_held_for > 0 {
            return;
        }
        nodes.iter_mut().for_each(|node| node.set_data_wire(true));
        let in_byte = matches!(self.phase, Phase::Free { in_byte: true, .. });
        self.dismiss_slaves(nodes, if in_byte { status::BUS_ERROR } else { status::STOP_OR_REPEATED_START });
        if let Phase::Free { .. } | Phase::Start { .. } = self.phase {
            let since = nodes.iter().map(Mcu::cycle).max().unwrap_or(0);
            self.phase = Phase::Free { since, in_byte: false };
        }
    }

    /// All masters lose the bus: SDA is held low, or the one whose byte it was has left.
    fn act_in_vain(&mut self, nodes: &mut [Mcu], now: u64) {
        let in_byte = matches!(self.phase, Phase::Byte { .. });
        for master in self.indices(Role::is_master) {
            self.roles[master] = Role::None;
            if in_byte {
                report(&mut nodes[master], status::ARBITRATION_LOST);
            }
        }
        self.phase = Phase::Free { since: now, in_byte };
    }

    /// The cycle at which the bus acts next; no node may run past it.
    pub(crate) fn due(&self) -> Option<u64> {
        let phase = match self.phase {
            Phase::Free { .. } | Phase::Held => None,
            Phase::Start { due, .. }
            | Phase::RepeatedStart { due }
            | Phase::Byte { due }
            | Phase::Stop { due } => Some(due),
        };
        [phase, self.departure].into_iter().flatten().min()
    }

    /// The fewest cycles from an action of one node to its effect on another.
    pub(crate) fn lookahead(&self) -> u64 {
        let quiet = !self.roles.iter().any(|role| matches!(role, Role::Slave { .. }));
        match self.phase {
            Phase::Free { .. } if quiet => self.shortest_bit * START_AND_ADDRESS_BITS,
            _ => self.shortest_bit,
        }
    }

    /// Processes what the nodes have done, and acts if all of them have come to the cycle at which the bus is
    /// due.
    pub(crate) fn advance(&mut self, nodes: &mut [Mcu]) {
        if self.is_as_before(nodes) {
            return;
        }
        self.see_clock_pulses(nodes);
        self.forget_stops(nodes);
        loop {
            self.plan(nodes);
            match self.due() {
                Some(due) if have_come_to(nodes, due) => self.act(nodes, due),
                _ => break,
            }
        }
        self.shortest_bit = nodes.iter().map(shortest_bit).min().unwrap_or(u64::MAX);
        for node in nodes {
            node.take(News::Bus);
        }
    }

    /// Whether no node has news and the bus is not due yet, as is the case most of the time.
    fn is_as_before(&self, nodes: &[Mcu]) -> bool {
        let is_new = |node: &Mcu| !node.is_alive() || node.has(News::Bus);
        let is_due = self.due().is_some_and(|due| have_come_to(nodes, due));
        !is_due && self.data_held_for == 0 && !nodes.iter().any(is_new)
    }

    // --- Planning -------------------------------------------------------------------------------

    /// TWSTO of a master asks for a STOP. It is no departure.
    fn forget_stops(&self, nodes: &mut [Mcu]) {
        for (role, node) in self.roles.iter().zip(nodes) {
            if role.is_master() && node.twi(|twi, _| twi.stopped_at().is_some()) {
                node.act_on_twi(|twi, _| twi.forget_stop());
            }
        }
    }

    fn plan(&mut self, nodes: &[Mcu]) {
        self.departure = self.departures(nodes).map(|(_, at)| at).min();
        match self.phase {
            Phase::Free { since, in_byte } | Phase::Start { since, in_byte, .. } => {
                self.phase = match self.start_due(nodes, since) {
                    Some(due) => Phase::Start { since, in_byte, due },
                    None => Phase::Free { since, in_byte },
                };
            }
            Phase::Held => self.go_on(nodes),
            Phase::RepeatedStart { .. } | Phase::Byte { .. } | Phase::Stop { .. } => {}
        }
    }

    /// The nodes that leave the bus, and the cycles at which they do.
    fn departures(&self, nodes: &[Mcu]) -> impl Iterator<Item = (usize, u64)> {
        self.roles
            .iter()
            .zip(nodes)
            .enumerate()
            .filter_map(|(index, (&role, node))| Some((index, left_at(node, role)?)))
    }

    /// End of the first START that a node which asks for one sends on the free bus.
    fn start_due(&self, nodes: &[Mcu], free_since: u64) -> Option<u64> {
        let abandoned = self.slaves().map(|slave| &nodes[slave]);
        if self.data_held_for > 0 || abandoned.clone().any(holds_clock) {
            return None;
        }
        let clock_free = abandoned.map(released_at).max().unwrap_or(0);
        self.roles
            .iter()
            .zip(nodes)
            .filter(|&(&role, _)| role == Role::None)
            .filter_map(|(_, node)| {
                Some(start_asked_at(node)?.max(free_since).max(clock_free) + start_bit(node))
            })
            .min()
    }

    /// Continues the transfer once no node holds the clock.
    fn go_on(&mut self, nodes: &[Mcu]) {
        if nodes.iter().any(holds_clock) {
            return;
        }
        let released = nodes.iter().map(released_at).max().unwrap_or(0);
        let bit = self.masters().map(|master| bit(&nodes[master])).max().unwrap_or(0);
        (self.released, self.bit) = (released, bit);
        let any = |wanted| self.masters().any(|master| command(&nodes[master]) == wanted);
        self.phase = if any(Command::Byte) {
            Phase::Byte { due: released + BYTE_BITS * bit }
        } else if any(Command::Stop) {
            Phase::Stop { due: released + bit }
        } else {
            Phase::RepeatedStart { due: released + bit }
        };
    }

    // --- Acting ---------------------------------------------------------------------------------

    fn act(&mut self, nodes: &mut [Mcu], now: u64) {
        if self.departure == Some(now) {
            return self.depart(nodes, now);
        }
        if self.data_held_for > 0 {
            return self.act_in_vain(nodes, now);
        }
        match self.phase {
            Phase::Start { in_byte, .. } => self.start(nodes, now, in_byte),
            Phase::RepeatedStart { .. } => self.repeated_start(nodes, now),
            Phase::Stop { .. } => self.stop(nodes, now),
            Phase::Byte { .. } => self.byte(nodes, now),
            Phase::Free { .. } | Phase::Held => {}
        }
    }

    /// The nodes that leave now have no role any more.
    fn depart(&mut self, nodes: &mut [Mcu], now: u64) {
        let leaving: Vec<_> = self.departures(nodes).filter(|&(_, at)| at == now).collect();
        for (index, _) in leaving {
            let node = &mut nodes[index];
            node.act_on_twi(|twi, cpu| twi.has_left(cpu, now));
            let was_slave = std::mem::replace(&mut self.roles[index], Role::None).is_slave();
            if let Phase::Free { since, .. } | Phase::Start { since, .. } = &mut self.phase
                && was_slave
            {
                let clock_free = if holds_clock(node) { now } else { released_at(node) };
                *since = (*since).max(clock_free);
            }
        }
        let in_byte = match self.phase {
            Phase::Free { .. } | Phase::Start { .. } => return,
            // The clock was still held: the masters that stay decide what follows.
            _ if now <= self.released => {
                self.phase = Phase::Held;
                false
            }
            Phase::Byte { .. } => true,
            Phase::Held | Phase::RepeatedStart { .. } | Phase::Stop { .. } => false,
        };
        if self.masters().next().is_none() {
            self.counts.abandoned += 1;
            self.phase = Phase::Free { since: now, in_byte };
        }
    }

    /// All nodes that asked before the START was over have sent it together.
    fn start(&mut self, nodes: &mut [Mcu], now: u64, in_byte: bool) {
        let in_time = |node: &Mcu| start_asked_at(node).is_some_and(|asked_at| asked_at < now);
        let starters: Vec<usize> = (0..nodes.len())
            .filter(|&index| self.roles[index] == Role::None && in_time(&nodes[index]))
            .collect();
        if in_byte {
            self.dismiss_slaves(nodes, status::BUS_ERROR);
        } else {
            self.dismiss_slaves(nodes, status::STOP_OR_REPEATED_START);
        }
        self.bit = starters.iter().map(|&index| start_bit(&nodes[index])).min().unwrap_or(0);
        for index in starters {
            self.roles[index] = Role::Master;
            report(&mut nodes[index], status::START);
        }
        self.note(now, 1, BusSignal::Start);
        self.next = NextByte::Address;
        self.phase = Phase::Held;
    }

    fn repeated_start(&mut self, nodes: &mut [Mcu], now: u64) {
        self.note(now, 1, BusSignal::Start);
        self.dismiss_slaves(nodes, status::STOP_OR_REPEATED_START);
        for master in self.indices(Role::is_master) {
            report(&mut nodes[master], status::REPEATED_START);
        }
        self.next = NextByte::Address;
        self.phase = Phase::Held;
    }

    /// A STOP wins over a repeated START, which needs SDA high where the STOP needs it low.
    fn stop(&mut self, nodes: &mut [Mcu], now: u64) {
        self.note(now, 1, BusSignal::Stop);
        self.dismiss_slaves(nodes, status::STOP_OR_REPEATED_START);
        for master in self.indices(Role::is_master) {
            self.roles[master] = Role::None;
            if command(&nodes[master]) == Command::Stop {
                nodes[master].act_on_twi(|twi, cpu| twi.stop_sent(cpu));
            } else {
                self.counts.arbitrations_lost += 1;
                report(&mut nodes[master], status::ARBITRATION_LOST);
            }
        }
        self.phase = Phase::Free { since: now, in_byte: false };
    }

    fn dismiss_slaves(&mut self, nodes: &mut [Mcu], status: u8) {
        for slave in self.indices(Role::is_slave) {
            self.roles[slave] = Role::None;
            report(&mut nodes[slave], status);
        }
    }

    fn byte(&mut self, nodes: &mut [Mcu], now: u64) {
        let sends = |master: usize| command(&nodes[master]) == Command::Byte;
        if self.next != NextByte::Read && !self.masters().any(sends) {
            self.counts.abandoned += 1;
            return self.act_in_vain(nodes, now);
        }
        self.counts.bytes += 1;
        self.phase = Phase::Held;
        let (value, acknowledged) = match self.next {
            NextByte::Address => self.address(nodes),
            NextByte::Written => self.written_byte(nodes),
            NextByte::Read => self.read_byte(nodes),
        };
        self.note(now, BYTE_BITS, BusSignal::Byte { value, acknowledged });
    }

    /// The address on the wire, and whether it was acknowledged.
    fn address(&mut self, nodes: &mut [Mcu]) -> (u8, bool) {
        let (byte, winners) = self.arbitrate(nodes);
        let (address, read) = (byte >> 1, byte & 1 != 0);
        let mut acknowledged = false;
        for (index, (node, role)) in nodes.iter_mut().zip(&mut self.roles).enumerate() {
            if winners.contains(&index) {
                continue;
            }
            let lost = role.is_master();
            let listens = acknowledges(node);
            let own = listens && address != 0 && address == own_address(node);
            let general_call = listens && byte == 0 && answers_general_call(node);
            *role = Role::None;
            if own || general_call || lost {
                node.act_on_twi(|twi, cpu| twi.receive(cpu, byte));
            }
            if own || general_call {
                acknowledged = true;
                *role = Role::Slave { general_call };
                let told = if read {
                    status::addressed_to_read(lost)
                } else {
                    status::addressed_to_write(general_call, lost)
                };
                report(node, told);
            } else if lost {
                report(node, status::ARBITRATION_LOST);
            }
        }
        self.next = if read { NextByte::Read } else { NextByte::Written };
        for winner in winners {
            let told =
                if read { status::address_read(acknowledged) } else { status::address_written(acknowledged) };
            report(&mut nodes[winner], told);
        }
        (byte, acknowledged)
    }

    fn written_byte(&mut self, nodes: &mut [Mcu]) -> (u8, bool) {
        let (byte, winners) = self.arbitrate(nodes);
        for loser in self.indices(Role::is_master) {
            if !winners.contains(&loser) {
                self.roles[loser] = Role::None;
                nodes[loser].act_on_twi(|twi, cpu| twi.receive(cpu, byte));
                report(&mut nodes[loser], status::ARBITRATION_LOST);
            }
        }
        let mut acknowledged = false;
        for (node, role) in nodes.iter_mut().zip(&mut self.roles) {
            let Role::Slave { general_call } = *role else { continue };
            let accepts = acknowledges(node);
            acknowledged |= accepts;
            if !accepts {
                *role = Role::None;
            }
            node.act_on_twi(|twi, cpu| {
                twi.receive(cpu, byte);
                twi.report(cpu, status::slave_received(general_call, accepts));
            });
        }
        for winner in winners {
            report(&mut nodes[winner], status::data_sent(acknowledged));
        }
        (byte, acknowledged)
    }

    fn read_byte(&mut self, nodes: &mut [Mcu]) -> (u8, bool) {
        let sent = |slave: usize| nodes[slave].twi(|twi, cpu| twi.data(cpu));
        // Without a sender no node pulls the wire low: it reads as ones.
        let byte = self.slaves().map(sent).fold(0xff, |wire, sent| wire & sent);
        let acknowledged = self.masters().any(|master| acknowledges(&nodes[master]));
        for slave in self.indices(Role::is_slave) {
            let told = if !acknowledged {
                status::SLAVE_SENT_AND_REFUSED
            } else if acknowledges(&nodes[slave]) {
                status::SLAVE_SENT
            } else {
                status::SLAVE_SENT_LAST
            };
            if told != status::SLAVE_SENT {
                self.roles[slave] = Role::None;
            }
            report(&mut nodes[slave], told);
        }
        for master in self.indices(Role::is_master) {
            let accepts = acknowledges(&nodes[master]);
            nodes[master].act_on_twi(|twi, cpu| twi.receive(cpu, byte));
            if acknowledged && !accepts {
                // Another master's acknowledgement won over this one's refusal.
                self.counts.arbitrations_lost += 1;
                self.roles[master] = Role::None;
                report(&mut nodes[master], status::ARBITRATION_LOST);
            } else {
                report(&mut nodes[master], status::data_received(accepts));
            }
        }
        (byte, acknowledged)
    }

    /// The byte on the wire when all masters send, and the nodes that are still masters after it. At each bit
    /// a zero wins. A master that wants a STOP or START where another one sends has lost, too.
    fn arbitrate(&mut self, nodes: &[Mcu]) -> (u8, Vec<usize>) {
        let mut senders = self.indices(Role::is_master);
        let masters = senders.len();
        senders.retain(|&sender| command(&nodes[sender]) == Command::Byte);
        let mut wire = 0;
        for bit in (0..8).rev() {
            let sends_one = |sender: &usize| nodes[*sender].twi(|twi, cpu| twi.data(cpu)) >> bit & 1;
            let level = senders.iter().map(sends_one).min().unwrap_or(1);
            senders.retain(|sender| sends_one(sender) == level);
            wire |= level << bit;
        }
        self.counts.arbitrations_lost += (masters - senders.len()) as u64;
        (wire, senders)
    }

    // --- Roles ----------------------------------------------------------------------------------

    fn masters(&self) -> impl Iterator<Item = usize> + Clone {
        self.positions(Role::is_master)
    }

    fn slaves(&self) -> impl Iterator<Item = usize> + Clone {
        self.positions(Role::is_slave)
    }

    fn positions(&self, are: fn(&Role) -> bool) -> impl Iterator<Item = usize> + Clone {
        self.roles.iter().enumerate().filter(move |(_, role)| are(role)).map(|(index, _)| index)
    }

    /// The nodes of one role, for a loop that changes roles.
    fn indices(&self, are: fn(&Role) -> bool) -> Vec<usize> {
        self.positions(are).collect()
    }
}

impl Role {
    fn is_master(&self) -> bool {
        *self == Self::Master
    }

    fn is_slave(&self) -> bool {
        matches!(self, Self::Slave { .. })
    }
}

/// Whether all nodes that are alive have come to a cycle.
fn have_come_to(nodes: &[Mcu], cycle: u64) -> bool {
    nodes.iter().all(|node| !node.is_alive() || node.cycle() >= cycle)
}

fn holds_clock(node: &Mcu) -> bool {
    node.twi(|twi, _| twi.holds_clock())
}

/// The cycle at which a node of this role leaves: it was reset, or its program ended, switched the interface
/// off or gave up its role by TWSTO. `None` if the node stays, or has left.
fn left_at(node: &Mcu, role: Role) -> Option<u64> {
    let (left_at, stopped_at, holds_clock) =
        node.twi(|twi, _| (twi.left_at(), twi.stopped_at(), twi.holds_clock()));
    let ended = !node.is_alive() && (role != Role::None || holds_clock);
    let ended_at = ended.then(|| node.cycle());
    [left_at, stopped_at.filter(|_| !role.is_master()), ended_at].into_iter().flatten().min()
}

fn released_at(node: &Mcu) -> u64 {
    node.twi(|twi, _| twi.released_at())
}

fn start_asked_at(node: &Mcu) -> Option<u64> {
    node.is_alive().then(|| node.twi(|twi, cpu| twi.start_asked_at(cpu))).flatten()
}

fn bit(node: &Mcu) -> u64 {
    node.twi(|twi, _| twi.bit())
}

fn start_bit(node: &Mcu) -> u64 {
    node.twi(|twi, _| twi.start_bit())
}

fn shortest_bit(node: &Mcu) -> u64 {
    node.twi(|twi, cpu| twi.shortest_bit(cpu))
}

fn command(node: &Mcu) -> Command {
    node.twi(|twi, _| twi.command())
}

fn acknowledges(node: &Mcu) -> bool {
    node.is_alive() && node.twi(|twi, cpu| twi.acknowledges(cpu))
}

fn own_address(node: &Mcu) -> u8 {
    node.twi(|twi, cpu| twi.own_address(cpu))
}

fn answers_general_call(node: &Mcu) -> bool {
    node.twi(|twi, cpu| twi.answers_general_call(cpu))
}

fn report(node: &mut Mcu, status: u8) {
    node.act_on_twi(|twi, cpu| twi.report(cpu, status));
}
