//! Serves the page, on this machine only. A client has to know the address, which has a token, and a page of
//! another origin is refused.

use std::error::Error;
use std::io::{self, Read, Write};
use std::sync::Arc;
use std::sync::mpsc::{self, Sender};
use std::thread;
use std::time::Duration;

use serde::Deserialize;
use tiny_http::{Header, Method, Request, Response};

use super::feed::{Feed, Stream};

/// The longest interval between two messages to a page. A page that hears nothing for longer takes the
/// connection for lost.
const HEARTBEAT: Duration = Duration::from_millis(500);

/// A message of no length.
const NOTHING: [u8; 8] = [0; 8];

/// The most bytes of a request that are read.
const LONGEST: u64 = 10_000;

/// The headers of each answer.
const HEADERS: [&str; 5] = [
    "Cache-Control: no-store",
    "Referrer-Policy: no-referrer",
    "X-Content-Type-Options: nosniff",
    "X-Frame-Options: DENY",
    "Cross-Origin-Resource-Policy: same-origin",
];

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
    http: tiny_http::Server,
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
        let http = tiny_http::Server::http(("127.0.0.1", port)).map_err(|error| {
            format!("can't serve the page at port {port}: {error}; give another with --view=PORT")
        })?;
        let mut token = [0; 16];
        getrandom::fill(&mut token).map_err(|error| format!("can't get random numbers: {error}"))?;
        let token = token.iter().map(|byte| format!("{byte:02x}")).collect();
        Ok(Server { http, page, token, feed, asked })
    }

    /// The address of the page.
    pub fn address(&self) -> String {
        format!("http://{}/{}/", self.host(), self.token)
    }

    fn host(&self) -> String {
        self.http.server_addr().to_string()
    }

    /// Serves for as long as the program runs.
    pub fn serve(self) {
        let server = Arc::new(self);
        for request in server.http.incoming_requests() {
            let server = Arc::clone(&server);
            // A thread for each request: a page may be slow or listen for long, and the run may be in a step.
            // The client may have gone.
            thread::spawn(move || server.answer(request));
        }
    }

    fn answer(&self, mut request: Request) -> io::Result<()> {
        if !self.is_own(&request) {
            return respond(request, 403, "only programs on this machine may open this page");
        }
        let url = request.url().to_owned();
        let path = url.strip_prefix('/').and_then(|path| path.strip_prefix(&self.token));
        let Some((path, query)) = path.map(|path| path.split_once('?').unwrap_or((path, ""))) else {
            return respond(
                request,
                404,
                "there is nothing here: open the address that ./x sim --view prints",
            );
        };
        match (request.method(), path) {
            (Method::Get, "/") => {
                let html = header("Content-Type: text/html; charset=utf-8");
                request.respond(with_headers(Response::from_string(&*self.page)).with_header(html))
            }
            (Method::Get, "/live") => {
                let had = query.strip_prefix("had=").and_then(|had| had.parse().ok()).unwrap_or(0);
                stream(request, &self.feed, had);
                Ok(())
            }
            (Method::Post, "/ask") => {
                let mut body = String::new();
                request.as_reader().take(LONGEST).read_to_string(&mut body)?;
                let stream = query.strip_prefix("stream=").and_then(|stream| stream.parse().ok());
                let (status, text) = match ask(&self.asked, stream, &body) {
                    Ok(text) => (200, text),
                    Err(text) => (409, text),
                };
                respond(request, status, &text)
            }
            _ => respond(request, 404, "there is no such page"),
        }
    }

    /// Whether a request comes from the page and was sent to this machine. It must not come from a page of
    /// another origin, nor use another host name that resolves to this machine.
    fn is_own(&self, request: &Request) -> bool {
        let field = |name: &'static str| {
            let header = request.headers().iter().find(|header| header.field.equiv(name));
            header.map(|header| header.value.as_str())
        };
        let asked = field("Host");
        asked.is_some_and(|asked| is_name(asked, &self.host()))
            && field("Origin")
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
fn stream(request: Request, feed: &Feed, had: usize) {
    let mut listener = feed.listen(had);
    let mut writer = request.into_writer();
    let head = format!(
        "HTTP/1.1 200 OK\r\n{}\r\nStream: {}\r\nContent-Type: application/octet-stream\r\n\
         Connection: close\r\n\r\n",
        HEADERS.join("\r\n"),
        listener.stream
    );
    let mut written = writer.write_all(head.as_bytes());
    while written.is_ok() {
        let messages = listener.next(HEARTBEAT);
        written = match &messages[..] {
            [] => writer.write_all(&NOTHING),
            new => new.iter().try_for_each(|message| writer.write_all(message)),
        };
        written = written.and_then(|()| writer.flush());
    }
}

fn respond(request: Request, status: u16, text: &str) -> io::Result<()> {
    request.respond(with_headers(Response::from_string(text)).with_status_code(status))
}

fn with_headers<R: Read>(response: Response<R>) -> Response<R> {
    HEADERS.iter().fold(response, |response, text| response.with_header(header(text)))
}

/// Parses a header that this file defines.
fn header(text: &str) -> Header {
    text.parse().expect("it is ASCII with a colon")
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
