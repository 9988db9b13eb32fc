//! How long runs of code take at most. A run is described by the functions and variables that it avoids.

use std::ops::Range;

use stack_bound::{Annotations, Found, Image};

use crate::bounds::response;
use crate::execution::Timer;
use crate::facts::{Avoided, View};
use crate::notes::{NoteError, Notes};
use crate::problem::Problem;
use crate::releases::Run;

/// An image, as its interrupts find a task's stack or the kernel's.
pub struct Costs<'a> {
    image: &'a Image,
    views: Vec<View>,
}

impl<'a> Costs<'a> {
    /// The costs of an image's code.
    ///
    /// # Errors
    /// Code that can't be followed, and notes that do not fit.
    pub fn new(image: &'a Image, annotations: &Annotations, notes: &Notes) -> Result<Self, Vec<Problem>> {
        let view = |found| View::new(image, annotations, notes, found);
        Ok(Costs { image, views: vec![view(Found::Task)?, view(Found::Kernel)?] })
    }

    /// The whole name of a function whose name may end with a `*`.
    pub(crate) fn whole_name<'b>(&'b self, name: &'b str) -> Option<&'b str> {
        self.image.whole_name(name)
    }

    /// How long a run takes at most, in cycles.
    ///
    /// # Errors
    /// Each problem that keeps it from having a bound.
    pub fn of(&self, run: &Run) -> Result<u64, Vec<Problem>> {
        let mut longest = 0;
        // A task's code never compares SP to find out whose stack it runs on.
        let views = if run.vector.is_some() { &self.views[..] } else { &self.views[..1] };
        for view in views {
            let whole = self.once(run, &run.without, view)?;
            let rest = if run.beyond.is_empty() {
                0
            } else {
                let without = [&run.without[..], &run.beyond[..]].concat();
                self.once(run, &without, view)?
            };
            longest = longest.max(whole.saturating_sub(rest));
        }
        Ok(longest * u64::from(run.times))
    }

    fn once(&self, run: &Run, without: &[String], view: &View) -> Result<u64, Vec<Problem>> {
        let View { flows, facts } = view;
        let mut facts = facts.clone();
        facts.avoided = self.avoided(without)?;
        let malformed = |error: NoteError| vec![Problem::Run { what: error.to_string() }];
        let notes = Notes::parse(&run.notes, self.image).map_err(malformed)?;
        facts.add(self.image, &notes, flows).map_err(Vec::from_iter)?;
        let mut timer = Timer::new(self.image, flows, &facts);
        let none = |what: String| vec![Problem::Run { what }];
        let image = self.image;
        let leads_nowhere = |what: String| none(format!("{what} has no path to its end without {without:?}"));
        let function = |name: &String| {
            image.function(name).ok_or_else(|| none(format!("the image has no function {name}")))
        };
        match (run.vector, &run.job, &run.function) {
            (Some(vector), None, None) => {
                let served = image.interrupts().find(|served| served.0 == vector);
                let (_, entry) =
                    served.ok_or_else(|| none(format!("the image serves no interrupt {vector}")))?;
                let whole = timer.function(entry).map_err(Vec::from_iter)?.whole;
                let whole = whole.ok_or_else(|| leads_nowhere(format!("interrupt {vector}")))?;
                Ok(whole + response(image, false)) // in a busy CPU
            }
            (None, Some(job), None) => {
                timer.function(function(job)?).map_err(Vec::from_iter)?;
                let turn = timer.jobs.values().nth(run.turn).copied();
                turn.ok_or_else(|| leads_nowhere(format!("job {} of {job}", run.turn)))
            }
            (None, None, Some(name)) => {
                let whole = timer.function(function(name)?).map_err(Vec::from_iter)?.whole;
                whole.ok_or_else(|| leads_nowhere(name.clone()))
            }
            _ => Err(none("a run has either a vector, a job or a function".to_owned())),
        }
    }

    fn avoided(&self, names: &[String]) -> Result<Avoided, Vec<Problem>> {
        let mut avoided = Avoided::default();
        for name in names {
            let functions = self.image.function(name).or_else(|| self.image.label(name));
            let mut places: Vec<_> = self.image.variable(name).cloned().collect();
            places.extend(register(name));
            if functions.is_none() && places.is_empty() {
                let what = format!("the image has neither a function nor a variable {name}");
                return Err(vec![Problem::Run { what }]);
            }
            avoided.functions.extend(functions);
            avoided.places.extend(places);
        }
        Ok(avoided)
    }
}

/// The address range of an I/O register that is named by its address in the data space, such as `0x24`.
fn register(name: &str) -> Option<Range<u16>> {
    let address = u16::from_str_radix(name.strip_prefix("0x")?, 16).ok()?;
    Some(address..address + 1)
}
