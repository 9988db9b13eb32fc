//! Requests at any dock, answers of inspectors, lack of room and lost answers, in any order: the console
//! sends the requested text to the one that requested it, and nothing else.
#![no_main]

use console::dialogue::Dialogue;
use console::request::{PIECE, Request, piece};
use libfuzzer_sys::fuzz_target;
use tasks::dock::{Dock, DockSet};
use tasks::message::{Address, MAX_PAYLOAD, Message, TaskCode};

const INSPECTORS: [Address; 2] =
    [Address::here(TaskCode::MASTER_INSPECTOR), Address::here(TaskCode::SLAVE_INSPECTOR)];

/// What has happened so far.
#[derive(Default)]
struct Past {
    /// The client that began the last text.
    client: Option<Address>,
    /// Requests taken that no piece has answered yet.
    requests: usize,
    /// The addressee of the last question, and that question.
    question: Option<(Address, Vec<u8>)>,
}

impl Past {
    fn receive(&mut self, dialogue: &mut Dialogue, from: Address, payload: &[u8]) {
        let is_taken = dialogue.receive(from, payload);
        if INSPECTORS.contains(&from) {
            return assert!(!is_taken || self.question.as_ref().is_some_and(|(to, _)| *to == from));
        }
        let request = Request::from_payload(payload);
        assert!(request.is_some() || !is_taken, "{payload:?} is no request");
        if is_taken {
            self.requests += 1;
        }
        if let Some(Request::Begin(_)) = request {
            assert!(is_taken, "whoever begins is served");
            (self.client, self.requests) = (Some(from), 1);
        }
    }

    fn check(&mut self, message: Message) {
        assert_eq!(message.from(), Address::here(TaskCode::CONSOLE));
        let payload = message.payload();
        if INSPECTORS.contains(&message.to()) {
            assert_eq!(payload.len(), 2);
            self.question = Some((message.to(), payload.to_vec()));
            return;
        }
        assert_eq!(Some(message.to()), self.client);
        let (_, text) = piece(payload).expect("nothing else goes to a dock");
        assert!(
            text.len() <= PIECE && text.iter().all(|&character| matches!(character, b'\n' | b' '..=b'~'))
        );
        assert!(self.requests > 0, "nobody asked for it");
        self.requests = 0;
    }
}

fuzz_target!(|input: &[u8]| {
    let mut dialogue = Dialogue::new(DockSet::of(&[Dock::Back, Dock::Up, Dock::Down]));
    let mut past = Past::default();
    let mut input = input;
    while let [what, rest @ ..] = input {
        let (bytes, rest) = rest.split_at(rest.len().min(usize::from(what >> 3)).min(MAX_PAYLOAD));
        input = rest;
        match (what & 7, Dock::from_index(what & 7)) {
            (0..=2, Some(dock)) => {
                past.receive(&mut dialogue, Address::beyond(dock, TaskCode::CONSOLE), bytes);
            }
            (3, _) => past.receive(&mut dialogue, INSPECTORS[bytes.len() % 2], bytes),
            // An answer to the last question.
            (4, _) => {
                if let Some((from, question)) = past.question.clone() {
                    let answer: Vec<u8> = question.iter().chain(bytes).copied().take(MAX_PAYLOAD).collect();
                    past.receive(&mut dialogue, from, &answer);
                }
            }
            (5, _) => dialogue.miss_answer(),
            (6, _) => dialogue.send(|_| false),
            _ => dialogue.send(|message| {
                past.check(message);
                true
            }),
        }
    }
});
