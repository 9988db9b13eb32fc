//! The bytes that come in at a dock: nothing that a neighbour sends reaches anything but behaviours.
//!
//! A CRC keeps noise out, but not a neighbour. So each frame gets a valid one.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tasks::dock::{Dock, DockSet};
use tasks::link::cobs::WireBuffer;
use tasks::link::endpoint::{Arrival, Endpoint};
use tasks::link::frame::{Frame, Label, Turn};
use tasks::link::signature::Signature;
use tasks::message::{Address, MAX_PAYLOAD, TaskCode};
use tasks::router::{Mcu, Residence, Residents, Route, Router, Source, TaskSet};

/// Every possible task is on both MCUs, and every dock.
const ALL: Residents = Residents { docks: DockSet::of(&Dock::ALL), tasks: TaskSet::ALL };

/// A frame made of the first bytes of `input`, as a neighbour may send it.
fn frame<'i>(input: &mut &'i [u8]) -> Option<Frame<'i>> {
    let [control, epoch, to, rest @ ..] = *input else { return None };
    let dock = Dock::from_index(control & 7)?;
    let signature = Signature { dock, epoch: *epoch };
    let label =
        Label { signature, turn: [Turn::Even, Turn::Odd, Turn::First][usize::from(control >> 3) % 3] };
    let (payload, rest) = rest.split_at(rest.len().min(usize::from(control >> 5) * 3).min(MAX_PAYLOAD));
    *input = rest;
    let to = TaskCode::of_behaviour(*to % TaskCode::BEHAVIOURS)?;
    Some(match epoch & 3 {
        0 => Frame::Ack(label),
        1 => Frame::Datagram { signature, to, payload },
        _ => Frame::Data { label, to, payload },
    })
}

/// Both MCUs' routers must keep a neighbour's message from docks and system tasks.
fn check(at: Dock, to: TaskCode, payload: &[u8]) {
    assert!(payload.len() <= MAX_PAYLOAD);
    for mcu in Mcu::ALL {
        match Router::new(mcu, Residence { master: ALL, slave: ALL })
            .route(Address::here(to), Source::Dock(at))
        {
            Route::Task(task) => assert!(task == to && task.is_behaviour(), "{to:?}"),
            route => panic!("{to:?} goes to {route:?}"),
        }
    }
}

fuzz_target!(|input: &[u8]| {
    let [dock, epoch, step, rest @ ..] = input else { return };
    let Some(at) = Dock::from_index(dock & 7) else { return };
    let mut endpoint = Endpoint::new(at, u16::from_be_bytes([*step, *epoch]), 3);
    let mut rest = rest;
    while let Some(sent) = frame(&mut rest) {
        if dock & 8 != 0 && !endpoint.sender.is_busy() {
            let _ = endpoint.sender.start();
        }
        let mut wire = WireBuffer::new();
        sent.encode(&mut wire).expect("the payload is short");
        let mut bytes = wire.bytes().to_vec();
        let frame = Frame::decode(&mut bytes).expect("it was just made");
        assert_eq!(frame, sent);
        match endpoint.on_frame(frame) {
            Arrival::Message { label, to, payload } => {
                check(at, to, payload);
                endpoint.accept(label);
                assert!(matches!(endpoint.on_frame(sent), Arrival::Duplicate(again) if again == label));
            }
            Arrival::Datagram { to, payload } => check(at, to, payload),
            Arrival::Delivered => assert!(!endpoint.sender.is_busy()),
            Arrival::Duplicate(_) | Arrival::StaleAck | Arrival::Reflection => {}
        }
    }
    // The raw bytes: almost all are refused.
    for wire in input.split_inclusive(|byte| *byte == 0) {
        if let Ok(Frame::Data { to, payload, .. } | Frame::Datagram { to, payload, .. }) =
            Frame::decode(&mut wire.to_vec())
        {
            check(at, to, payload);
        }
    }
});
