//! What pages are told: messages in order, kept for pages that come later or come back.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// A page that listens, from when it begins to until it goes: a number that no other has.
pub type Stream = u64;

/// A message, as pages read it.
pub type Message = Arc<[u8]>;

/// What is in the place of one that is for the moment: an object with nothing in it.
const NOTHING: &[u8] = b"\x02\0\0\0\0\0\0\0{}";

/// The messages, and who listens.
#[derive(Default)]
pub struct Feed {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Default)]
struct State {
    messages: Vec<Message>,
    /// By page, the place of the last one that is for it and for the moment, and that message.
    passing: BTreeMap<Stream, (usize, Message)>,
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

    /// Tells a page what is of no use any more once the next such message comes.
    pub fn tell_for_now(&self, stream: Stream, message: Vec<u8>) {
        let mut state = self.state();
        let place = state.messages.len();
        state.messages.push(NOTHING.into());
        state.passing.insert(stream, (place, message.into()));
        drop(state);
        self.changed.notify_all();
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
