//! A log of what the tasks of a test did, in order.

use std::sync::Mutex;

pub struct Log(Mutex<Vec<String>>);

impl Log {
    pub const fn new() -> Self {
        Log(Mutex::new(Vec::new()))
    }

    pub fn note(&self, what: impl Into<String>) {
        self.0.lock().unwrap().push(what.into());
    }

    #[track_caller]
    pub fn expect(&self, expected: &[&str]) {
        assert_eq!(*self.0.lock().unwrap(), expected);
    }
}
