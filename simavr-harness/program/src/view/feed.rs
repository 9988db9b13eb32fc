//! What pages are told: messages in order, kept for pages that come later or come back.

use std::collections::BTreeSet;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// A page that listens, from when it begins to until it goes: a number that no other has.
pub type Stream = u64;

/// A message, as pages read it.
pub type Message = Arc<[u8]>;

/// What is in the place of one that was for the moment: an object with nothing in it.
const GONE: &[u8] = b"\x02\0\0\0\0\0\0\0{}";

/// The messages, and who listens.
#[derive(Default)]
pub struct Feed {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Default)]
struct State {
    messages: Vec<Message>,
    /// The place of one that is for the moment.
    passing: Option<usize>,
    listening: BTreeSet<Stream>,
    streams: u64,
}

/// A page that listens, for as long as this is there.
pub struct Listener<'a> {
    feed: &'a Feed,
    pub stream: Stream,
    /// How many messages it has got.
    had: usize,
}

impl Feed {
    /// Tells all pages, also those that come later.
    pub fn tell(&self, message: Vec<u8>) {
        self.state().messages.push(message.into());
        self.changed.notify_all();
    }

    /// Tells pages what is of no use any more once the next such message comes.
    pub fn tell_for_now(&self, message: Vec<u8>) {
        let mut state = self.state();
        let place = state.messages.len();
        if let Some(before) = state.passing.replace(place) {
            state.messages[before] = GONE.into();
        }
        drop(state);
        self.tell(message);
    }

    /// A page listens that has got so many messages before.
    pub fn listen(&self, had: usize) -> Listener<'_> {
        let mut state = self.state();
        state.streams += 1;
        let stream = state.streams;
        state.listening.insert(stream);
        drop(state);
        self.changed.notify_all();
        Listener { feed: self, stream, had }
    }

    /// Whether this page listens still.
    pub fn has(&self, stream: Stream) -> bool {
        self.state().listening.contains(&stream)
    }

    /// Waits until nobody has listened for so long: a page that is loaded anew is back by then.
    pub fn wait_until_alone(&self, patience: Duration) {
        let mut state = self.state();
        loop {
            let waited = self.changed.wait_timeout(state, patience);
            let (now, timeout) = waited.unwrap_or_else(PoisonError::into_inner);
            if timeout.timed_out() && now.listening.is_empty() {
                return;
            }
            state = now;
        }
    }

    /// Nobody panics while it is locked; what is there is whole all the same.
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Listener<'_> {
    /// The messages that are new to it, for which it waits so long; none if none comes.
    pub fn next(&mut self, patience: Duration) -> Vec<Message> {
        let state = self.feed.state();
        let is_new = |state: &mut State| state.messages.len() <= self.had;
        let waited = self.feed.changed.wait_timeout_while(state, patience, is_new);
        let (state, _) = waited.unwrap_or_else(PoisonError::into_inner);
        let new = state.messages.get(self.had..).unwrap_or_default().to_vec();
        self.had += new.len();
        new
    }
}

impl Drop for Listener<'_> {
    fn drop(&mut self) {
        self.feed.state().listening.remove(&self.stream);
        self.feed.changed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const AT_ONCE: Duration = Duration::ZERO;

    #[test]
    fn who_comes_late_or_comes_back_gets_all_in_order() {
        let feed = Feed::default();
        feed.tell(vec![1]);
        feed.tell(vec![2]);
        let read = |listener: &mut Listener| -> Vec<u8> {
            listener.next(AT_ONCE).iter().flat_map(|message| message.to_vec()).collect()
        };
        let (mut late, mut back) = (feed.listen(0), feed.listen(1));
        assert_eq!([read(&mut late), read(&mut back)], [vec![1, 2], vec![2]]);
        feed.tell(vec![3]);
        assert_eq!([read(&mut late), read(&mut late)], [vec![3], vec![]]);
        assert_eq!(read(&mut feed.listen(9)), [0; 0], "it has got more than there was");
    }

    #[test]
    fn what_is_for_the_moment_is_not_kept_and_keeps_its_place() {
        let feed = Feed::default();
        feed.tell_for_now(vec![1]);
        assert_eq!(feed.listen(0).next(AT_ONCE), [Message::from([1])]);
        feed.tell(vec![2]);
        feed.tell_for_now(vec![3]);
        assert_eq!(feed.listen(0).next(AT_ONCE), [GONE, &[2], &[3]].map(Message::from));
    }

    #[test]
    fn it_is_alone_once_the_last_page_has_gone() {
        let feed = Feed::default();
        std::thread::scope(|scope| {
            let listener = feed.listen(0);
            let waiting = scope.spawn(|| feed.wait_until_alone(Duration::from_millis(20)));
            std::thread::sleep(Duration::from_millis(100));
            assert!(!waiting.is_finished());
            let stream = listener.stream;
            assert!(feed.has(stream));
            drop(listener);
            assert!(!feed.has(stream));
        });
    }
}
