//! The program behind `./x console`: a [`Terminal`] at a serial port with an infrared transceiver, held
//! before a dock that has no neighbour. Prints what the module tells.

use std::ffi::{OsStr, OsString};
use std::fs::{File, OpenOptions};
use std::io::{self, Read, Write};
use std::process::{Command, ExitCode};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::{Duration, Instant};

use console::request::Topic;
use simulation::Terminal;
use tasks::superbot::BAUD;

const USAGE: &str = "\
Usage: superbot-console PORT [all|tasks|cpu|links]

Asks a module for a text, through the infrared transceiver at the serial port PORT, and prints the text.";

/// How often the terminal looks at the clock.
const LOOK: Duration = Duration::from_millis(2);

/// How long there may be nothing new.
const PATIENCE: Duration = Duration::from_secs(5);

fn main() -> ExitCode {
    let arguments: Vec<OsString> = std::env::args_os().skip(1).collect();
    let asked = match &arguments[..] {
        [port] if !port.as_encoded_bytes().starts_with(b"-") => Some((port, Topic::All)),
        [port, topic] => topic.to_str().and_then(topic_named).map(|topic| (port, topic)),
        _ => None,
    };
    let Some((port, topic)) = asked else {
        eprintln!("{USAGE}");
        return ExitCode::from(2);
    };
    match open(port).and_then(|port| converse(port.try_clone()?, port, topic, PATIENCE)) {
        Ok(text) => match io::stdout().write_all(text.as_bytes()) {
            Ok(()) => ExitCode::SUCCESS,
            Err(error) => {
                eprintln!("superbot-console: can't write to the standard output: {error}");
                ExitCode::FAILURE
            }
        },
        Err(error) => {
            eprintln!("superbot-console: {}: {error}", port.display());
            ExitCode::FAILURE
        }
    }
}

fn topic_named(name: &str) -> Option<Topic> {
    match name {
        "all" => Some(Topic::All),
        "tasks" => Some(Topic::Tasks),
        "cpu" => Some(Topic::Cpu),
        "links" => Some(Topic::Counts),
        _ => None,
    }
}

/// The port, set to what the docks speak: 8 bits, no parity, one stop bit, and nothing done to the bytes.
fn open(port: &OsStr) -> io::Result<File> {
    let file = OpenOptions::new().read(true).write(true).open(port)?;
    let mut stty = Command::new("stty");
    stty.arg("-F").arg(port).arg(BAUD.to_string());
    stty.args(["raw", "-echo", "cs8", "-cstopb", "-parenb", "-crtscts", "clocal"]);
    let output = stty.output()?;
    if output.status.success() {
        Ok(file)
    } else {
        let what = String::from_utf8_lossy(&output.stderr).trim().to_string();
        Err(io::Error::other(format!("can't set the port to {BAUD} baud ({what})")))
    }
}

/// Asks until the text is complete.
///
/// # Errors
/// Where nothing new has come for `patience`, with what came before; and those of the port.
fn converse(
    mut from: impl Read + Send + 'static,
    mut to: impl Write,
    topic: Topic,
    patience: Duration,
) -> io::Result<String> {
    let (sender, bytes) = mpsc::channel();
    thread::spawn(move || {
        let mut buffer = [0; 64];
        while let Ok(count @ 1..) = from.read(&mut buffer) {
            if sender.send(buffer[..count].to_vec()).is_err() {
                break;
            }
        }
    });
    let start = Instant::now();
    let mut terminal = Terminal::new(topic, 0);
    let mut news = (0, start);
    while !terminal.is_complete() {
        let come = match bytes.recv_timeout(LOOK) {
            Ok(come) => come,
            Err(RecvTimeoutError::Timeout) => Vec::new(),
            Err(RecvTimeoutError::Disconnected) => return Err(io::Error::other("the port was closed")),
        };
        let now = Instant::now();
        to.write_all(&terminal.step(now.duration_since(start).as_millis() as u64, come))?;
        if terminal.text().len() != news.0 {
            news = (terminal.text().len(), now);
        } else if now.duration_since(news.1) > patience {
            let text = terminal.text();
            return Err(io::Error::other(format!(
                "no answer: hold the transceiver before a dock without a neighbour; received so far:\n{text}"
            )));
        }
    }
    Ok(terminal.text().into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use console::request::{Number, Request};
    use std::os::unix::net::UnixStream;
    use tasks::dock::Dock;
    use tasks::link::cobs::WireBuffer;
    use tasks::link::frame::{Frame, Label, Turn};
    use tasks::link::signature::Signature;
    use tasks::message::TaskCode;

    const PIECES: [&str; 4] = ["all is ", "well", "\n", ""];

    fn send(stream: &mut UnixStream, frame: Frame) {
        let mut wire = WireBuffer::new();
        frame.encode(&mut wire).unwrap();
        stream.write_all(wire.bytes()).unwrap();
    }

    /// A module that tells [`PIECES`], and reflects what it is sent.
    fn module(mut stream: UnixStream) {
        let mut wire = Vec::new();
        let mut byte = [0];
        let mut epoch = 7;
        while let Ok(1) = stream.read(&mut byte) {
            wire.push(byte[0]);
            if byte[0] != 0 {
                continue;
            }
            stream.write_all(&wire).unwrap();
            let mut frame = std::mem::take(&mut wire);
            let (label, payload) = match Frame::decode(&mut frame).unwrap() {
                Frame::Data { label, to: TaskCode::CONSOLE, payload } => (label, payload),
                Frame::Ack(label) => {
                    assert_eq!(
                        label.signature,
                        Signature { dock: Dock::Front, epoch },
                        "what it sent itself"
                    );
                    continue;
                }
                other => panic!("{other:?}"),
            };
            let number = match Request::from_payload(payload).unwrap() {
                Request::Begin(topic) => {
                    assert_eq!(topic, Topic::Cpu);
                    Number::FIRST
                }
                Request::Next(number) => number.next(),
            };
            send(&mut stream, Frame::Ack(label));
            let text = PIECES[usize::from(number.byte() - Number::FIRST.byte())];
            let piece = [&[number.byte()], text.as_bytes()].concat();
            epoch += 1;
            let label = Label { signature: Signature { dock: Dock::Front, epoch }, turn: Turn::First };
            send(&mut stream, Frame::Data { label, to: TaskCode::CONSOLE, payload: &piece });
        }
    }

    #[test]
    fn a_text_comes_whole_through_a_port_that_hears_itself() {
        let (ours, theirs) = UnixStream::pair().unwrap();
        thread::spawn(move || module(theirs));
        let text = converse(ours.try_clone().unwrap(), ours, Topic::Cpu, PATIENCE).unwrap();
        assert_eq!(text, "all is well\n");
    }

    #[test]
    fn silence_is_told_of() {
        let (ours, _theirs) = UnixStream::pair().unwrap();
        let patience = Duration::from_millis(50);
        let error = converse(ours.try_clone().unwrap(), ours, Topic::All, patience).unwrap_err();
        assert!(error.to_string().contains("before a dock"), "{error}");
    }

    #[test]
    fn what_is_no_serial_port_is_refused() {
        assert!(open("/dev/null".as_ref()).unwrap_err().to_string().contains("can't set the port to"));
        assert!(open("/there/is/none".as_ref()).is_err());
    }
}
