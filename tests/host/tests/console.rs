//! The console: its texts, and that a terminal gets them whole.

use console::dialogue::Dialogue;
use console::inspector::WORKS;
use console::question::BRIDGE;
use console::request::{Number, Request, Topic, piece};
use simulation::{Random, Terminal};
use tasks::dock::{Dock, DockSet};
use tasks::link::cobs::WireBuffer;
use tasks::link::frame::{Frame, Label, Turn};
use tasks::link::signature::Signature;
use tasks::message::{Address, MAX_PAYLOAD, TaskCode};

const SLAVE: DockSet = DockSet::of(&[Dock::Back, Dock::Up, Dock::Down]);

const CLIENT: Address = Address::beyond(Dock::Up, TaskCode::CONSOLE);
const MASTER: Address = Address::here(TaskCode::MASTER_INSPECTOR);

/// A message that the dialogue sends.
#[derive(Clone, PartialEq, Debug)]
struct Sent {
    to: Address,
    payload: Vec<u8>,
}

fn sent(dialogue: &mut Dialogue) -> Option<Sent> {
    let mut sent = None;
    dialogue.send(|message| {
        assert_eq!(message.from(), Address::here(TaskCode::CONSOLE));
        assert!(message.payload().len() <= MAX_PAYLOAD);
        sent = Some(Sent { to: message.to(), payload: message.payload().to_vec() });
        true
    });
    sent
}

fn ask(dialogue: &mut Dialogue, from: Address, request: Request) -> bool {
    request.with_payload(|payload| dialogue.receive(from, payload))
}

/// An inspector's made-up answer to a valid question.
fn answer(inspector: Address, payload: &[u8]) -> Vec<u8> {
    let &[kind, index] = payload else { panic!("no question: {payload:?}") };
    let base = if inspector == MASTER { 100 } else { 200 };
    let docks = if inspector == MASTER { [0, 2, 3] } else { [1, 4, 5] };
    let words: Vec<u16> = match kind {
        0 if inspector == MASTER => vec![WORKS - 35, 0b10],
        0 => vec![0, 0b1_1111],
        1 => {
            assert!(index < if inspector == MASTER { 11 } else { 9 }, "there is no such task");
            vec![index.into(), base, base / 3]
        }
        _ => {
            let of = kind - 2;
            assert!(of >= BRIDGE || docks.contains(&of), "asked of another's link");
            let all = [12, 12, 12, 12, 12, 12, 8, 2, 2][usize::from(of)];
            (u16::from(index)..all).take(7).map(|count| base * u16::from(of) + count).collect()
        }
    };
    let words = words.into_iter().flat_map(u16::to_le_bytes);
    payload.iter().copied().chain(words).collect()
}

/// The payload of the next message to the client. The inspectors answer meanwhile.
fn next_piece(dialogue: &mut Dialogue) -> Option<Vec<u8>> {
    while let Some(Sent { to, payload }) = sent(dialogue) {
        if to == CLIENT {
            return Some(payload);
        }
        assert!(dialogue.receive(to, &answer(to, &payload)));
    }
    None
}

/// The text about `topic`, with each message lost with probability `loss`. The inspector `silent` does not
/// answer.
fn text(topic: Topic, silent: Option<Address>, loss: f64, random: &mut Random) -> String {
    let mut dialogue = Dialogue::new(SLAVE);
    let (mut text, mut expected, mut request) = (Vec::new(), Number::FIRST, Request::Begin(topic));
    loop {
        if !random.chance(loss) {
            ask(&mut dialogue, CLIENT, request);
        }
        while let Some(Sent { to, payload }) = sent(&mut dialogue) {
            if to == CLIENT {
                let (number, characters) = piece(&payload).expect("a piece");
                if number == expected && !random.chance(loss) {
                    if characters.is_empty() {
                        return String::from_utf8(text).expect("a text");
                    }
                    text.extend(characters);
                    (expected, request) = (number.next(), Request::Next(number));
                }
            } else if silent == Some(to) || random.chance(loss) {
                assert!(dialogue.awaits_answer());
                dialogue.miss_answer();
            } else {
                assert!(dialogue.receive(to, &answer(to, &payload)));
            }
        }
    }
}

const ALL: &str = "\
SuperBot 0.1.0
master: awake for 7.0 % of 50 ms, reset by RESET pin
slave: awake for 100.0 % of 50 ms, reset by power-on, RESET pin, brown-out, watchdog, JTAG

master           priority  stack unused
joints                 0    100     33
receive                1    100     33
bridge                 2    100     33
send USART0            3    100     33
send USART1            4    100     33
send soft UART         5    100     33
devices                6    100     33
AC_RECV                7    100     33
AC_SEND                8    100     33
HORMONE                9    100     33
inspector             10    100     33

slave            priority  stack unused
joints                 0    200     66
receive                1    200     66
bridge                 2    200     66
send USART0            3    200     66
send USART1            4    200     66
send soft UART         5    200     66
devices                6    200     66
console                7    200     66
inspector              8    200     66

links              Front   Back   Left  Right     Up   Down
frames_sent            0    200    200    300    800   1000
frames_received        1    201    201    301    801   1001
retries                2    202    202    302    802   1002
errors                 3    203    203    303    803   1003
duplicates             4    204    204    304    804   1004
gave_up                5    205    205    305    805   1005
reflections            6    206    206    306    806   1006
ignored                7    207    207    307    807   1007
refused                8    208    208    308    808   1008
no_buffer              9    209    209    309    809   1009
overruns              10    210    210    310    810   1010
replaced              11    211    211    311    811   1011

bridge            master  slave
messages_sent        600   1200
messages_received    601   1201
retries              602   1202
errors               603   1203
gave_up              604   1204
ignored              605   1205
no_buffer            606   1206
freed                607   1207

joints' control   master  slave
periods              700   1400
missed               701   1401

devices           master  slave
unsent               800   1600
malformed            801   1601
";

#[test]
fn the_text_tells_what_the_inspectors_answer() {
    assert_eq!(text(Topic::All, None, 0.0, &mut Random::new(1)), ALL);
}

#[test]
fn a_topic_is_a_part_of_all() {
    let parts: Vec<&str> = ALL.split("\n\n").collect();
    let [head, tasks @ .., links, bridge, joints, devices] = &parts[..] else { panic!("{parts:?}") };
    let title = head.split_inclusive('\n').next().expect("a line");
    let mut random = Random::new(1);
    assert_eq!(text(Topic::Cpu, None, 0.0, &mut random), format!("{head}\n"));
    assert_eq!(text(Topic::Tasks, None, 0.0, &mut random), format!("{title}\n{}\n", tasks.join("\n\n")));
    assert_eq!(
        text(Topic::Counts, None, 0.0, &mut random),
        format!("{title}\n{links}\n\n{bridge}\n\n{joints}\n\n{devices}")
    );
}

#[test]
fn whoever_does_not_answer_is_told_of_once() {
    let text = text(Topic::All, Some(MASTER), 0.0, &mut Random::new(1));
    let expected = "\
SuperBot 0.1.0
no answer from the master
slave: awake for 100.0 % of 50 ms, reset by power-on, RESET pin, brown-out, watchdog, JTAG

slave            priority  stack unused
";
    assert!(text.starts_with(expected), "{text}");
    assert!(text.contains("\nretries                -    202      -      -    802   1002\n"), "{text}");
    assert!(text.contains("\nperiods                -   1400\n"), "{text}");
    assert_eq!(text.matches("no answer").count(), 1);
}

/// A question is asked three times at most, a piece until it comes.
#[test]
fn what_is_lost_is_made_good() {
    let mut random = Random::new(3);
    for _ in 0..200 {
        assert_eq!(text(Topic::All, None, 0.02, &mut random), ALL);
    }
}

#[test]
fn a_piece_without_room_waits() {
    let mut dialogue = Dialogue::new(SLAVE);
    ask(&mut dialogue, CLIENT, Request::Begin(Topic::Cpu));
    for _ in 0..3 {
        dialogue.send(|_| false);
        assert!(dialogue.has_mail());
    }
    let first = sent(&mut dialogue).expect("the piece");
    assert_eq!(first.payload[0], Number::FIRST.byte());
    assert!(!dialogue.has_mail());
    assert_eq!(sent(&mut dialogue), None);
}

#[test]
fn the_last_that_begins_is_served_and_no_other_goes_on() {
    let mut dialogue = Dialogue::new(SLAVE);
    let other = Address::beyond(Dock::Front, TaskCode::CONSOLE);
    let next = Request::Next(Number::FIRST);
    assert!(!ask(&mut dialogue, CLIENT, next), "nothing was begun");
    assert!(ask(&mut dialogue, CLIENT, Request::Begin(Topic::Cpu)));
    assert_eq!(sent(&mut dialogue).map(|sent| sent.to), Some(CLIENT));
    assert!(!ask(&mut dialogue, other, next));
    assert_eq!(sent(&mut dialogue), None);
    assert!(ask(&mut dialogue, CLIENT, next));
    assert_eq!(sent(&mut dialogue).map(|sent| sent.to), Some(MASTER));
    assert!(ask(&mut dialogue, other, Request::Begin(Topic::Cpu)));
    assert!(!dialogue.receive(MASTER, &answer(MASTER, &[0, 0])), "the answer to nobody");
    assert_eq!(sent(&mut dialogue).map(|sent| sent.to), Some(other));
    assert!(!ask(&mut dialogue, CLIENT, next));
    assert_eq!(sent(&mut dialogue), None);
}

#[test]
fn a_text_that_is_begun_anew_comes_from_its_first_piece() {
    let mut dialogue = Dialogue::new(SLAVE);
    ask(&mut dialogue, CLIENT, Request::Begin(Topic::Cpu));
    let first = sent(&mut dialogue).expect("the first piece");
    for taken in 1..10 {
        let mut number = Number::FIRST;
        for _ in 0..taken {
            assert!(ask(&mut dialogue, CLIENT, Request::Next(number)));
            number = number.next();
            next_piece(&mut dialogue).expect("a piece");
        }
        ask(&mut dialogue, CLIENT, Request::Begin(Topic::Cpu));
        assert_eq!(sent(&mut dialogue).as_ref(), Some(&first), "after {taken} more");
    }
}

#[test]
fn only_the_last_piece_comes_again_and_none_after_the_end() {
    let mut dialogue = Dialogue::new(SLAVE);
    ask(&mut dialogue, CLIENT, Request::Begin(Topic::Cpu));
    let mut pieces = Vec::new();
    while let Some(payload) = next_piece(&mut dialogue) {
        let (number, characters) = piece(&payload).expect("a piece");
        let is_end = characters.is_empty();
        pieces.push((number, payload));
        if !is_end {
            ask(&mut dialogue, CLIENT, Request::Next(number));
        }
    }
    let [(first, _), .., (before, _), (last, end)] = &pieces[..] else { panic!("{pieces:?}") };
    for number in [*last, *first] {
        assert!(!ask(&mut dialogue, CLIENT, Request::Next(number)), "{number:?}");
        assert_eq!(sent(&mut dialogue), None);
    }
    assert!(ask(&mut dialogue, CLIENT, Request::Next(*before)));
    assert_eq!(sent(&mut dialogue).map(|sent| sent.payload).as_ref(), Some(end));
}

/// What it takes and what it refuses is counted.
#[test]
fn while_an_answer_is_awaited_only_that_and_repeated_requests_are_taken() {
    let mut dialogue = Dialogue::new(SLAVE);
    ask(&mut dialogue, CLIENT, Request::Begin(Topic::Cpu));
    let mut last = Number::FIRST;
    let question = loop {
        let Sent { to, payload } = sent(&mut dialogue).expect("a piece or a question");
        let Some((number, _)) = piece(&payload) else { break payload };
        assert_eq!(to, CLIENT);
        assert!(ask(&mut dialogue, CLIENT, Request::Next(number)));
        last = number;
    };
    assert!(dialogue.awaits_answer());
    assert!(ask(&mut dialogue, CLIENT, Request::Next(last)), "repeated");
    assert!(!ask(&mut dialogue, CLIENT, Request::Next(last.next().next())), "of no piece");
    let whole = answer(MASTER, &question);
    assert!(!dialogue.receive(MASTER, &whole[..whole.len() - 1]), "half a word");
    assert!(dialogue.awaits_answer());
    assert!(dialogue.receive(MASTER, &whole));
}

/// A module may take the place of a terminal.
#[test]
fn a_text_is_no_request_to_another_console() {
    let mut dialogue = Dialogue::new(SLAVE);
    let mut neighbour = Dialogue::new(SLAVE);
    let mut request = Request::Begin(Topic::All);
    loop {
        ask(&mut dialogue, CLIENT, request);
        while let Some(payload) = next_piece(&mut dialogue) {
            assert!(!neighbour.receive(CLIENT, &payload));
            assert_eq!(sent(&mut neighbour), None);
            let (number, characters) = piece(&payload).expect("a piece");
            if characters.is_empty() {
                return;
            }
            request = Request::Next(number);
        }
    }
}

/// A dock with a console behind it, as a terminal sees them. Frames are lost both ways, and only the terminal
/// repeats them.
struct Port {
    dialogue: Dialogue,
    random: Random,
    loss: f64,
    turn: u8,
}

impl Port {
    /// Takes `bytes` from the terminal. Returns the bytes that the dock sends.
    fn hear(&mut self, bytes: &[u8]) -> Vec<u8> {
        for frame in bytes.split_inclusive(|&byte| byte == 0) {
            let mut frame = frame.to_vec();
            match Frame::decode(&mut frame).expect("the terminal sends frames") {
                Frame::Data { label, to, payload } => {
                    assert_eq!(to, TaskCode::CONSOLE);
                    assert_ne!(label.signature.dock, Dock::Up, "it might be a reflection");
                    if !self.random.chance(self.loss) {
                        self.dialogue.receive(CLIENT, payload);
                    }
                }
                Frame::Ack(label) => assert_eq!(label, self.label()),
                Frame::Datagram { .. } => panic!("a terminal does not probe"),
            }
        }
        let mut wire = Vec::new();
        while let Some(Sent { to, payload }) = sent(&mut self.dialogue) {
            if to != CLIENT {
                self.dialogue.receive(to, &answer(to, &payload));
            } else if !self.random.chance(self.loss) {
                self.turn = self.turn.wrapping_add(1);
                wire = frame(Frame::Data { label: self.label(), to: TaskCode::CONSOLE, payload: &payload });
            }
        }
        wire
    }

    fn label(&self) -> Label {
        Label { signature: Signature { dock: Dock::Up, epoch: self.turn }, turn: Turn::Even }
    }
}

fn frame(frame: Frame) -> Vec<u8> {
    let mut wire = WireBuffer::new();
    frame.encode(&mut wire).expect("it can be said");
    wire.bytes().to_vec()
}

#[test]
fn a_terminal_gets_the_text_whole() {
    for (seed, loss) in (1..).zip([0.0, 0.1, 0.3]) {
        let mut port = Port { dialogue: Dialogue::new(SLAVE), random: Random::new(seed), loss, turn: 0 };
        let mut terminal = Terminal::new(Topic::All, 0);
        let signature = Signature { dock: Dock::Up, epoch: 7 };
        let mut wire = frame(Frame::Datagram { signature, to: TaskCode::AC_RECEIVE, payload: &[0] });
        let mut now = 0;
        while !terminal.is_complete() {
            now += 10;
            assert!(now < 1_000_000, "never done");
            let sent = terminal.step(now, wire);
            wire = port.hear(&sent);
        }
        assert_eq!(terminal.text(), ALL);
    }
}

#[test]
fn what_came_stays_while_the_module_is_silent_and_gives_way_to_what_it_tells_anew() {
    let module = || Some(Port { dialogue: Dialogue::new(SLAVE), random: Random::new(1), loss: 0.0, turn: 0 });
    let mut terminal = Terminal::new(Topic::All, 0);
    let mut come = String::new();
    // The module has sent a part, is silent, and has been reset.
    for (mut port, times) in [(module(), 0..200), (None, 200..10_000), (module(), 10_000..20_000)] {
        let mut wire = Vec::new();
        for now in times.step_by(10) {
            let sent = terminal.step(now, wire);
            wire = port.as_mut().map_or_else(Vec::new, |port| port.hear(&sent));
        }
        if port.is_some() {
            come = terminal.text().to_owned();
        }
        assert!(!come.is_empty());
        assert_eq!(terminal.text(), come);
    }
    assert_eq!(come, ALL);
}
