//! Swept: pools, messages, queues, byte FIFOs and pipes.
#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use board::debug::mark;
use kernel::{Message, Pipe, Queue, Task};
use tests_images::sweep::{
    self, BYTES, Did, GO_LOW, GO_MIDDLE, NOTES, NOTHING, PIPED, Parcel, note, path, send,
};

board::tick_interrupt!();
board::external_interrupt!(interrupt => sweep::external(interrupt));

struct Letter(u8);
kernel::pool!(Letter, 3);

static LETTERS: Queue<Letter> = Queue::new(2);
static PIPE: Pipe<2> = Pipe::new();

kernel::main!(|boot| sweep::start_all(boot, director, middle, |_, _| {}, low));

fn director(task: &mut Task) {
    path(task, 0, |task| {
        drop(Message::new(task, Parcel(1)).ok());
        drop((Message::new(task, Parcel(2)).ok(), Message::new(task, Parcel(3)).ok()));
        NOTHING
    });
    path(task, 1, |task| {
        post(task, 1);
        post(task, 2);
        open(LETTERS.try_receive(task));
        open(Some(LETTERS.receive(task)));
        open(LETTERS.try_receive(task));
        NOTHING
    });
    // To a higher task that waits.
    path(task, 2, |task| {
        GO_MIDDLE.post(task);
        post(task, 1);
        mark(3);
        NOTHING
    });
    // From a higher task to a lower one that waits.
    path(task, 3, |task| {
        GO_LOW.post(task);
        GO_MIDDLE.post(task);
        mark(3);
        NOTHING
    });
    // No room in the queue, no buffer in the pool.
    path(task, 4, |task| {
        post(task, 1);
        post(task, 2);
        post(task, 3);
        let last = Message::new(task, Letter(4));
        post(task, 5);
        drop(last);
        open(LETTERS.try_receive(task));
        open(LETTERS.try_receive(task));
        NOTHING
    });
    // Through the pool and queue that the interrupt uses: to a higher task, and from there to a lower one.
    path(task, 5, |task| {
        send(task);
        send(task);
        NOTHING
    });
    path(task, 6, |task| {
        GO_MIDDLE.post(task);
        NOTHING
    });
    path(task, 7, |task| {
        BYTES.put(task, 1);
        BYTES.put(task, 2);
        let taken = BYTES.take(task).is_some();
        Did { bytes: 2 - i16::from(taken), ..NOTHING }
    });
    path(task, 8, |task| {
        mark(if LETTERS.receive_timeout(task, 1).is_ok() { 0x1f } else { 0x10 });
        GO_LOW.post(task);
        post(task, 1);
        mark(3);
        NOTHING
    });
    // Through the queue that the interrupt uses, which is soon full.
    path(task, 9, |task| {
        note(task);
        let first = NOTES.try_receive(task);
        note(task);
        note(task);
        note(task);
        let taken = [
            first,
            NOTES.receive_timeout(task, 1).ok(),
            NOTES.receive_timeout(task, 1).ok(),
            NOTES.receive_timeout(task, 1).ok(),
        ];
        Did { notes: taken.iter().flatten().count() as u16, ..NOTHING }
    });
    path(task, 10, |task| {
        PIPE.put(task, 1);
        mark(PIPE.take(task));
        PIPE.put(task, 2);
        PIPE.flush(task);
        mark(PIPE.try_take(task).unwrap_or(0x10));
        NOTHING
    });
    // To a higher task that waits for bytes.
    path(task, 11, |task| {
        GO_MIDDLE.post(task);
        PIPE.put(task, 1);
        PIPE.try_put(task, 2);
        mark(3);
        NOTHING
    });
    // From a higher task that waits for space.
    path(task, 12, |task| {
        GO_MIDDLE.post(task);
        for _ in 0..4 {
            mark(PIPE.take(task));
        }
        NOTHING
    });
    path(task, 13, |task| {
        PIPED.put(task, 1);
        PIPED.take(task);
        let taken = PIPED.take_timeout(task, 1).is_ok();
        Did { piped: -i16::from(taken), ..NOTHING }
    });
}

fn middle(task: &mut Task, path: u8) {
    match path {
        2 => open(Some(LETTERS.receive(task))),
        3 => {
            post(task, 1);
            mark(2);
        }
        6 => {
            send(task);
            send(task);
            send(task);
        }
        11 => {
            mark(0x10 + PIPE.take(task));
            mark(0x10 + PIPE.take(task));
        }
        12 => {
            for byte in 1..=4 {
                PIPE.put(task, byte);
                mark(0x10 + byte);
            }
        }
        _ => {}
    }
}

fn low(task: &mut Task, path: u8) {
    match path {
        3 => open(Some(LETTERS.receive(task))),
        8 => open(LETTERS.receive_timeout(task, 1000).ok()),
        _ => {}
    }
}

/// Sends a letter; marks it when there is no buffer or no room.
fn post(task: &mut Task, number: u8) {
    match Message::new(task, Letter(number)) {
        Err(_) => mark(0x20 + number),
        Ok(letter) => {
            if LETTERS.send(task, letter).is_err() {
                mark(0x30 + number);
            }
        }
    }
}

/// Marks the letter's number.
fn open(letter: Option<Message<Letter>>) {
    mark(letter.map_or(0x1e, |letter| 0x10 + letter.0));
}
