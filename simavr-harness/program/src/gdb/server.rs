//! Speaks gdb's remote protocol, by gdbstub.

use std::error::Error;
use std::io::{self, BufReader, Read, Write};
use std::net::TcpStream;
use std::sync::Arc;
use std::sync::mpsc::{self, Receiver, Sender};
use std::thread;

use gdbstub::conn::Connection;
use gdbstub::stub::state_machine::GdbStubStateMachine;
use gdbstub::stub::{GdbStub, GdbStubError, MultiThreadStopReason};
use simavr_harness::Image;

use super::order::{Line, Report};
use super::target::Stopped;

/// An event for the server.
enum Event {
    /// A byte from gdb.
    Byte(u8),
    GdbIsGone,
    Report(Report),
    WorkerIsGone,
}

type Stub = GdbStubStateMachine<'static, Stopped, Buffered>;
type Broken = GdbStubError<io::Error, io::Error>;

/// Serves gdb until it disconnects. `worker` runs an MCU with this image, and has stopped.
///
/// # Errors
/// The worker is gone, or the connection to gdb breaks.
pub fn serve(gdb: TcpStream, worker: Line, image: Arc<Image>, first: Report) -> Result<(), Box<dyn Error>> {
    gdb.set_nodelay(true)?;
    let (sender, events) = mpsc::channel();
    let (from_gdb, from_worker) = (gdb.try_clone()?, Line::new(worker.stream().try_clone()?));
    thread::spawn({
        let sender = sender.clone();
        move || hear_gdb(from_gdb, &sender)
    });
    thread::spawn(move || hear_worker(from_worker, &sender));
    converse(gdb, &mut Stopped::new(worker, image, first), &events)
}

fn hear_gdb(gdb: TcpStream, events: &Sender<Event>) {
    for byte in BufReader::new(gdb).bytes().map_while(Result::ok) {
        if events.send(Event::Byte(byte)).is_err() {
            return;
        }
    }
    let _ = events.send(Event::GdbIsGone);
}

fn hear_worker(mut worker: Line, events: &Sender<Event>) {
    while let Some(report) = worker.receive() {
        if events.send(Event::Report(report)).is_err() {
            return;
        }
    }
    let _ = events.send(Event::WorkerIsGone);
}

fn converse(gdb: TcpStream, stopped: &mut Stopped, events: &Receiver<Event>) -> Result<(), Box<dyn Error>> {
    const WORKER_IS_GONE: &str = "the process that ran the robot has ended: see the message above";
    let mut settings = Settings::default();
    let mut stub = begin(gdb.try_clone()?, stopped, &settings).map_err(|e| failed(&e))?;
    loop {
        stub = match stub {
            GdbStubStateMachine::Idle(stub) => match events.recv()? {
                Event::Byte(byte) => {
                    let heard = stub.incoming_data(stopped, byte);
                    settings.go_on(heard, byte, &gdb, stopped)?
                }
                Event::GdbIsGone => return Ok(()),
                Event::Report(_) => stub.into(),
                Event::WorkerIsGone => return Err(WORKER_IS_GONE.into()),
            },
            GdbStubStateMachine::Running(stub) => match events.recv()? {
                Event::Byte(byte) => {
                    let heard = stub.incoming_data(stopped, byte);
                    settings.go_on(heard, byte, &gdb, stopped)?
                }
                Event::GdbIsGone => return Ok(()),
                Event::Report(report) => {
                    let reason = stopped.again(report);
                    settings.keep(packet(&format!("Hg{:x}", stopped.current())));
                    stub.report_stop(stopped, reason).map_err(|e| failed(&e))?
                }
                Event::WorkerIsGone => return Err(WORKER_IS_GONE.into()),
            },
            GdbStubStateMachine::CtrlCInterrupt(stub) => {
                stopped.interrupt()?;
                let not_yet = None::<MultiThreadStopReason<u32>>;
                stub.interrupt_handled(stopped, not_yet).map_err(|e| failed(&e))?
            }
            GdbStubStateMachine::Disconnected(mut stub) => return Ok(stub.borrow_conn().flush()?),
        };
    }
}

fn failed(error: &dyn std::fmt::Display) -> String {
    format!("gdb's server: {error}")
}

/// A new stub with the settings that gdb has made before, from the kept packets. It is in the state of the
/// MCU: stopped or running.
fn begin(gdb: TcpStream, stopped: &mut Stopped, settings: &Settings) -> Result<Stub, Broken> {
    let mut stub = GdbStub::new(Buffered { gdb: None, bytes: Vec::new() }).run_state_machine(stopped)?;
    // This orders nothing of an MCU that runs.
    let running = stopped.is_running().then(|| packet("vCont;c"));
    for &byte in settings.kept.iter().chain(&running).flatten() {
        if let GdbStubStateMachine::Idle(idle) = stub {
            stub = idle.incoming_data(stopped, byte)?;
        }
    }
    match &mut stub {
        GdbStubStateMachine::Idle(stub) => stub.borrow_conn().gdb = Some(gdb),
        GdbStubStateMachine::Running(stub) => stub.borrow_conn().gdb = Some(gdb),
        _ => {}
    }
    Ok(stub)
}

/// Whether the error is due to gdb's packet, not to a lost connection to gdb or the worker.
fn is_of_gdb(error: &Broken) -> bool {
    !error.is_connection_error() && !error.is_target_error()
}

/// The packet with this body.
fn packet(body: &str) -> Vec<u8> {
    let sum = body.bytes().fold(0, u8::wrapping_add);
    format!("${body}#{sum:02x}").into_bytes()
}

/// The settings that gdb has made by packets. A packet that gdbstub does not accept ends its stub, and the
/// next stub needs the settings.
#[derive(Default)]
struct Settings {
    /// The packet that is being received.
    coming: Vec<u8>,
    kept: Vec<Vec<u8>>,
}

impl Settings {
    /// The begins of packets with settings: the features of gdb, whether packets are acknowledged, and the
    /// task that gdb asks for.
    const ALL: [&str; 3] = ["$qSupported", NO_ACKNOWLEDGEMENTS, "$Hg"];

    /// Returns the stub that goes on after this byte from gdb. `heard` is what the last stub made of it.
    /// If that stub has ended because of it, there is a new one. An invalid packet is refused, and a byte
    /// between packets that means nothing is ignored.
    fn go_on(
        &mut self,
        heard: Result<Stub, Broken>,
        byte: u8,
        gdb: &TcpStream,
        stopped: &mut Stopped,
    ) -> Result<Stub, Box<dyn Error>> {
        let packet = self.hear(byte);
        match heard {
            Ok(stub) => {
                packet.into_iter().for_each(|packet| self.keep(packet));
                Ok(stub)
            }
            Err(error) if is_of_gdb(&error) => {
                if packet.is_some() {
                    (&mut &*gdb).write_all(self.refusal())?;
                }
                begin(gdb.try_clone()?, stopped, self).map_err(|e| failed(&e).into())
            }
            Err(error) => Err(failed(&error).into()),
        }
    }

    /// Returns the packet that ends with this byte.
    fn hear(&mut self, byte: u8) -> Option<Vec<u8>> {
        // `$` begins a packet; within a packet it is escaped.
        if byte == b'$' {
            self.coming.clear();
        }
        self.coming.push(byte);
        let is_whole = self.coming.starts_with(b"$") && self.coming.iter().rev().nth(2) == Some(&b'#');
        is_whole.then(|| std::mem::take(&mut self.coming))
    }

    /// Keeps a packet with a setting, in place of the last one of its kind.
    fn keep(&mut self, packet: Vec<u8>) {
        if let Some(begin) = Self::ALL.into_iter().find(|begin| packet.starts_with(begin.as_bytes())) {
            self.kept.retain(|kept| !kept.starts_with(begin.as_bytes()));
            self.kept.push(packet);
        }
    }

    /// The answer to an invalid packet.
    fn refusal(&self) -> &'static [u8] {
        let is_bare = self.kept.iter().any(|packet| packet.starts_with(NO_ACKNOWLEDGEMENTS.as_bytes()));
        if is_bare { b"$E16#ac" } else { b"+$E16#ac" }
    }
}

const NO_ACKNOWLEDGEMENTS: &str = "$QStartNoAckMode";

/// A connection that buffers bytes until they are flushed.
struct Buffered {
    /// `None`: what is sent is dropped.
    gdb: Option<TcpStream>,
    bytes: Vec<u8>,
}

impl Connection for Buffered {
    type Error = io::Error;

    fn write(&mut self, byte: u8) -> io::Result<()> {
        self.bytes.push(byte);
        Ok(())
    }

    fn flush(&mut self) -> io::Result<()> {
        let bytes = std::mem::take(&mut self.bytes);
        self.gdb.as_mut().map_or(Ok(()), |gdb| Write::write_all(gdb, &bytes))
    }
}
