//! The messages for pages, in order. They are kept for pages that come later or come back.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// The unique number of a page, from when it begins to listen until it leaves.
pub type Stream = u64;

/// A message in the form that pages read.
pub type Message = Arc<[u8]>;

/// An empty object, which takes the place of a transient message.
const NOTHING: &[u8] = b"\x02\0\0\0\0\0\0\0{}";

/// The messages, and the pages that listen.
#[derive(Default)]
pub struct Feed {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Default)]
struct State {
    messages: Vec<Message>,
    /// By page, the last transient message for it, and its place among the messages.
    passing: BTreeMap<Stream, (usize, Message)>,
    listening: BTreeSet<Stream>,
    streams: u64,
}

/// A page that listens for as long as this exists.
pub struct Listener<'a> {
    feed: &'a Feed,
    pub stream: Stream,
    /// The number of messages that it has received.
    had: usize,
}

impl Feed {
    /// Sends a message to all pages, including those that come later.
    pub fn tell(&self, message: Vec<u8>) {
        self.state().messages.push(message.into());
        self.changed.notify_all();
    }

    /// Sends a page a transient message, which the next such message for the page replaces.
    pub fn tell_for_now(&self, stream: Stream, message: Vec<u8>) {
        let mut state = self.state();
        let place = state.messages.len();
        state.messages.push(NOTHING.into());
        state.passing.insert(stream, (place, message.into()));
        drop(state);
        self.changed.notify_all();
    }

    /// Begins to listen for a page that has received `had` messages before.
    pub fn listen(&self, had: usize) -> Listener<'_> {
        let mut state = self.state();
        state.streams += 1;
        let stream = state.streams;
        state.listening.insert(stream);
        drop(state);
        self.changed.notify_all();
        Listener { feed: self, stream, had }
    }

    /// Whether a page still listens.
    pub fn has(&self, stream: Stream) -> bool {
        self.state().listening.contains(&stream)
    }

    /// Waits until no page has listened for the time `patience`, in which a page that is reloaded comes back.
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

    /// Locks the state. No thread panics while it holds the lock, so the state is consistent even if
    /// poisoned.
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Listener<'_> {
    /// The messages that are new to the page. Waits for the first one up to the time `patience`; empty if
    /// none comes.
    pub fn next(&mut self, patience: Duration) -> Vec<Message> {
        let state = self.feed.state();
        let is_new = |state: &mut State| state.messages.len() <= self.had;
        let waited = self.feed.changed.wait_timeout_while(state, patience, is_new);
        let (state, _) = waited.unwrap_or_else(PoisonError::into_inner);
        let mut new = state.messages.get(self.had..).unwrap_or_default().to_vec();
        if let Some((place, message)) = state.passing.get(&self.stream)
            && let Some(its) = place.checked_sub(self.had).and_then(|place| new.get_mut(place))
        {
            its.clone_from(message);
        }
        self.had += new.len();
        new
    }
}

impl Drop for Listener<'_> {
    fn drop(&mut self) {
        let mut state = self.feed.state();
        state.listening.remove(&self.stream);
        state.passing.remove(&self.stream);
        drop(state);
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
    fn what_is_for_the_moment_is_for_one_page_is_not_kept_and_keeps_its_place() {
        let feed = Feed::default();
        let [mut its, mut late, mut other] = [0, 0, 0].map(|had| feed.listen(had));
        let [stream, late_stream] = [its.stream, late.stream];
        let tell_both = |text: u8| [stream, late_stream].map(|it| feed.tell_for_now(it, vec![text]));
        tell_both(1);
        assert_eq!(its.next(AT_ONCE), [&[1], NOTHING].map(Message::from));
        feed.tell(vec![2]);
        tell_both(3);
        assert_eq!(its.next(AT_ONCE), [&[2], &[3], NOTHING].map(Message::from));
        assert_eq!(late.next(AT_ONCE), [NOTHING, NOTHING, &[2], NOTHING, &[3]].map(Message::from));
        assert_eq!(other.next(AT_ONCE), [NOTHING, NOTHING, &[2], NOTHING, NOTHING].map(Message::from));
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
