//! Serves the page, on this machine only. A client has to know the address, which has a token, and a page of
//! another origin is refused.

use std::error::Error;
use std::io::{self, BufRead, BufReader, Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::mpsc::{self, Sender};
use std::thread;
use std::time::Duration;

use serde::Deserialize;

use super::feed::{Feed, Stream};

/// The longest interval between two messages to a page. A page that hears nothing for longer takes the
/// connection for lost.
const HEARTBEAT: Duration = Duration::from_millis(500);

/// A message of no length.
const NOTHING: [u8; 8] = [0; 8];

/// The most bytes of a request: a browser sends all cookies that it has of this host.
const LONGEST: u64 = 100_000;

/// How long a client may say nothing before its request is whole. A browser connects ahead of what it needs.
const SILENCE: Duration = Duration::from_secs(10);

/// The headers of each answer.
const HEADERS: [&str; 6] = [
    "Cache-Control: no-store",
    "Referrer-Policy: no-referrer",
    "X-Content-Type-Options: nosniff",
    "X-Frame-Options: DENY",
    "Cross-Origin-Resource-Policy: same-origin",
    "Connection: close",
];

const TEXT: &str = "text/plain; charset=utf-8";

/// A wish of a page to the run.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Wish {
    /// Run until this time since power-up, in s.
    Until(f64),
    /// Make an event happen now: an event of a robot file, without its time.
    Event(String),
    /// Send the inside of this module from now on, or of none.
    Inspect(Option<usize>),
    /// Return the events that have happened, as a robot file.
    Timeline,
}

/// The answer to a wish.
pub type Answer = Result<String, String>;

/// A wish, and the channel for its answer.
pub struct Asked {
    pub wish: Wish,
    /// The page that asks, if it gave its number.
    pub stream: Option<Stream>,
    pub answer: Sender<Answer>,
}

/// Serves the page, its messages, and answers to its wishes.
pub struct Server {
    listener: TcpListener,
    address: SocketAddr,
    page: String,
    token: String,
    feed: Arc<Feed>,
    asked: Sender<Asked>,
}

impl Server {
    /// A server at a port of the loopback interface; 0 stands for any free port. Wishes go to `asked`.
    ///
    /// # Errors
    /// The port is taken, or the machine has no random numbers.
    pub fn new(
        page: String,
        port: u16,
        feed: Arc<Feed>,
        asked: Sender<Asked>,
    ) -> Result<Self, Box<dyn Error>> {
        let bound = TcpListener::bind((Ipv4Addr::LOCALHOST, port));
        let bound = bound.and_then(|listener| Ok((listener.local_addr()?, listener)));
        let (address, listener) = bound.map_err(|error| {
            format!("can't serve the page at port {port}: {error}; give another with --view=PORT")
        })?;
        let mut token = [0; 16];
        getrandom::fill(&mut token).map_err(|error| format!("can't get random numbers: {error}"))?;
        let token = token.iter().map(|byte| format!("{byte:02x}")).collect();
        Ok(Server { listener, address, page, token, feed, asked })
    }

    /// The address of the page.
    pub fn address(&self) -> String {
        format!("http://{}/{}/", self.address, self.token)
    }

    /// Serves for as long as the program runs.
    pub fn serve(self) {
        let server = Arc::new(self);
        loop {
            let Ok((client, _)) = server.listener.accept() else {
                // The system has no room for another client until one has gone.
                thread::sleep(HEARTBEAT);
                continue;
            };
            let server = Arc::clone(&server);
            // A thread for each client: a page may be slow or listen for long, and the run may be in a step.
            // The client may have gone, or there may be no room for a thread: then it is not answered.
            let _ = thread::Builder::new().spawn(move || server.answer(client));
        }
    }

    fn answer(&self, client: TcpStream) -> io::Result<()> {
        client.set_read_timeout(Some(SILENCE))?;
        client.set_nodelay(true)?;
        let request = Request::read(&client)?;
        if !self.is_own(&request) {
            return respond(
                client,
                "403 Forbidden",
                TEXT,
                "only programs on this machine may open this page",
            );
        }
        let path = request.url.strip_prefix('/').and_then(|path| path.strip_prefix(&self.token));
        let Some((path, query)) = path.map(|path| path.split_once('?').unwrap_or((path, ""))) else {
            let nothing = "there is nothing here: open the address that ./x sim --view prints";
            return respond(client, "404 Not Found", TEXT, nothing);
        };
        match (&*request.method, path) {
            ("GET", "/") => respond(client, "200 OK", "text/html; charset=utf-8", &self.page),
            ("GET", "/live") => {
                let had = query.strip_prefix("had=").and_then(|had| had.parse().ok()).unwrap_or(0);
                stream(client, &self.feed, had);
                Ok(())
            }
            ("POST", "/ask") => {
                let stream = query.strip_prefix("stream=").and_then(|stream| stream.parse().ok());
                match ask(&self.asked, stream, &request.body) {
                    Ok(text) => respond(client, "200 OK", TEXT, &text),
                    Err(text) => respond(client, "409 Conflict", TEXT, &text),
                }
            }
            _ => respond(client, "404 Not Found", TEXT, "there is no such page"),
        }
    }

    /// Whether a request comes from the page and was sent to this machine. It must not come from a page of
    /// another origin, nor use another host name that resolves to this machine.
    fn is_own(&self, request: &Request) -> bool {
        let asked = request.field("host");
        asked.is_some_and(|asked| is_name(asked, &self.address.to_string()))
            && request
                .field("origin")
                .is_none_or(|origin| Some(origin) == asked.map(|it| format!("http://{it}")).as_deref())
    }
}

/// Whether the host `asked` is this address of the loopback interface. A browser leaves port 80 out.
fn is_name(asked: &str, address: &str) -> bool {
    let asked = asked.replace("localhost", "127.0.0.1");
    asked == address || Some(&*asked) == address.strip_suffix(":80")
}

/// Hands a wish to the run, and waits for the answer.
fn ask(asked: &Sender<Asked>, stream: Option<Stream>, body: &str) -> Answer {
    let wish = serde_json::from_str(body).map_err(|error| format!("the request is not valid: {error}"))?;
    let (answer, answered) = mpsc::channel();
    let is_over = |_| "the run is over".to_owned();
    asked.send(Asked { wish, stream, answer }).map_err(|_| is_over(mpsc::RecvError))?;
    answered.recv().map_err(is_over)?
}

/// Writes messages as they come, until the page leaves. The header `Stream` tells the page its number.
fn stream(mut page: TcpStream, feed: &Feed, had: usize) {
    let mut listener = feed.listen(had);
    let number = listener.stream;
    let mut written = begin(&page, "200 OK", &format!("application/octet-stream\r\nStream: {number}"));
    while written.is_ok() {
        let messages = listener.next(HEARTBEAT);
        written = match &messages[..] {
            [] => page.write_all(&NOTHING),
            new => new.iter().try_for_each(|message| page.write_all(message)),
        };
    }
}

fn respond(client: TcpStream, status: &str, content_type: &str, content: &str) -> io::Result<()> {
    begin(&client, status, &format!("{content_type}\r\nContent-Length: {}", content.len()))?;
    (&client).write_all(content.as_bytes())
}

/// Writes the head of an answer; `fields` begin with the type of the content.
fn begin(mut client: &TcpStream, status: &str, fields: &str) -> io::Result<()> {
    let common = HEADERS.join("\r\n");
    let head = format!("HTTP/1.1 {status}\r\n{common}\r\nContent-Type: {fields}\r\n\r\n");
    client.write_all(head.as_bytes())
}

/// A request of HTTP/1.1.
struct Request {
    method: String,
    url: String,
    /// Names in small letters, and values.
    fields: Vec<(String, String)>,
    body: String,
}

impl Request {
    /// Reads the request of a client. Nothing but what has come takes memory, whatever the head says.
    ///
    /// # Errors
    /// It is none, or too long; or it has not come within [`SILENCE`].
    fn read(client: impl Read) -> io::Result<Self> {
        let none = || io::Error::from(io::ErrorKind::InvalidData);
        let mut reader = BufReader::new(client.take(LONGEST));
        let mut line = || {
            let mut line = String::new();
            reader.read_line(&mut line)?;
            line.strip_suffix('\n').map(|line| line.trim_end_matches('\r').to_owned()).ok_or_else(none)
        };
        let first = line()?;
        let mut words = first.split(' ');
        let (Some(method), Some(url)) = (words.next(), words.next()) else { return Err(none()) };
        let mut fields = Vec::new();
        loop {
            let line = line()?;
            if line.is_empty() {
                break;
            }
            let (name, value) = line.split_once(':').ok_or_else(none)?;
            fields.push((name.to_ascii_lowercase(), value.trim().to_owned()));
        }
        let mut request = Request { method: method.into(), url: url.into(), fields, body: String::new() };
        if let Some(length) = request.field("content-length") {
            let length: u64 = length.parse().map_err(|_| none())?;
            let read = reader.take(length).read_to_string(&mut request.body)?;
            if read as u64 != length {
                return Err(none());
            }
        }
        Ok(request)
    }

    fn field(&self, name: &str) -> Option<&str> {
        let field = self.fields.iter().find(|(its, _)| its == name);
        field.map(|(_, value)| value.as_str())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_browser_leaves_port_80_out_and_no_other() {
        for host in ["127.0.0.1", "localhost"] {
            for port in [80, 8080] {
                let address = format!("127.0.0.1:{port}");
                assert!(is_name(&format!("{host}:{port}"), &address));
                assert_eq!(is_name(host, &address), port == 80);
                assert!(!is_name(&format!("{host}:81"), &address));
            }
            assert!(!is_name(&format!("{host}.example"), "127.0.0.1:80"));
        }
    }
}
