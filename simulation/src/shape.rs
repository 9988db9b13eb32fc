//! Wirings by name, one for each gait of the paper.

use serde::Deserialize;
use tasks::dock::Dock::{self, Back, Front, Left, Right};
use thiserror::Error;

use crate::wiring::{Face, Wiring};

/// How modules are joined.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Shape {
    /// A head, branches with two legs each, spines, a tail (paper, section 7): for N modules (N - 2) / 4
    /// branches, each followed by a spine, and the spines that are left before the tail. 100 modules have 24
    /// branches and 26 spines.
    Centipede,
    /// A line, the Back of each module at the Front of the next: a caterpillar or a snake.
    Chain,
    /// A chain whose last Back is at the first Front: a rolling track.
    Ring,
    /// A centipede of two branches; modules more than 8 are spines before the tail.
    FourLegs,
    /// A centipede of three branches; modules more than 11 are spines before the tail.
    SixLegs,
    /// A module with a chain at each of its Front, Back, Left and Right, as even as can be, the Back of each
    /// arm's modules towards the middle but for the one at Back: the butterfly stroke.
    Cross,
    /// Shoulders with an arm at each side, and behind them a pelvis with two legs (paper, Figure 1); modules
    /// more than 6 are spines between them. It has no module for a head: the Front of the shoulders is free.
    Human,
}

/// A shape needs more modules.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("a robot of this shape has at least {least} modules; give it more")]
pub struct TooFewModules {
    pub least: usize,
}

impl Shape {
    pub const ALL: [Shape; 7] = [
        Shape::Centipede,
        Shape::Chain,
        Shape::Ring,
        Shape::FourLegs,
        Shape::SixLegs,
        Shape::Cross,
        Shape::Human,
    ];

    /// As robot files and the command line call it.
    pub fn name(self) -> &'static str {
        match self {
            Shape::Centipede => "centipede",
            Shape::Chain => "chain",
            Shape::Ring => "ring",
            Shape::FourLegs => "four-legs",
            Shape::SixLegs => "six-legs",
            Shape::Cross => "cross",
            Shape::Human => "human",
        }
    }

    /// How many modules it has if no number is given.
    pub fn usual_modules(self) -> usize {
        match self {
            Shape::Centipede => 100,
            Shape::Chain => 5,
            Shape::Ring => 6,
            Shape::FourLegs => 8,
            Shape::SixLegs => 11,
            Shape::Cross => 5,
            Shape::Human => 6,
        }
    }

    fn least_modules(self) -> usize {
        match self {
            Shape::Centipede | Shape::Chain => 1,
            Shape::Ring => 2,
            Shape::FourLegs => 8,
            Shape::SixLegs => 11,
            Shape::Cross => 5,
            Shape::Human => 6,
        }
    }

    /// The wiring of so many modules. Indices run from head to tail, each branch followed by its left and its
    /// right leg.
    ///
    /// # Errors
    /// The shape needs more modules.
    pub fn wiring(self, modules: usize) -> Result<Wiring, TooFewModules> {
        let least = self.least_modules();
        if modules < least {
            return Err(TooFewModules { least });
        }
        Ok(match self {
            Shape::Centipede => centipede(modules, modules.saturating_sub(2) / 4),
            Shape::FourLegs => centipede(modules, 2),
            Shape::SixLegs => centipede(modules, 3),
            Shape::Chain => centipede(modules, 0),
            Shape::Ring => ring(modules),
            Shape::Cross => cross(modules),
            Shape::Human => human(modules),
        })
    }
}

/// Attaches docks that are free by construction.
struct Builder(Wiring);

impl Builder {
    fn attach(&mut self, one: (usize, Dock), other: (usize, Dock)) {
        let [one, other] = [one, other].map(|(module, dock)| Face { module, dock });
        let attached = self.0.attach(one, other);
        debug_assert!(attached.is_ok(), "{one:?} to {other:?}: {attached:?}");
    }
}

/// A head, so many branches with their legs and a spine behind each, as far as there are modules for spines,
/// then the other spines and a tail.
fn centipede(modules: usize, branches: usize) -> Wiring {
    let mut builder = Builder(Wiring::new(modules));
    let mut spines = modules.saturating_sub(2 + 3 * branches);
    let (mut last, mut next) = (0, 1);
    for _ in 0..branches {
        builder.attach((last, Back), (next, Front));
        builder.attach((next, Left), (next + 1, Back));
        builder.attach((next, Right), (next + 2, Back));
        (last, next) = (next, next + 3);
        if spines > 0 {
            builder.attach((last, Back), (next, Front));
            (last, next, spines) = (next, next + 1, spines - 1);
        }
    }
    for module in next..modules {
        builder.attach((last, Back), (module, Front));
        last = module;
    }
    builder.0
}

fn ring(modules: usize) -> Wiring {
    let mut builder = Builder(centipede(modules, 0));
    builder.attach((modules - 1, Back), (0, Front));
    builder.0
}

fn cross(modules: usize) -> Wiring {
    let mut builder = Builder(Wiring::new(modules));
    let ends = [(Front, Back, Front), (Back, Front, Back), (Left, Back, Front), (Right, Back, Front)];
    let mut tips = ends.map(|(at_centre, ..)| (0, at_centre));
    for module in 1..modules {
        let arm = (module - 1) % ends.len();
        let (_, inner, outer) = ends[arm];
        builder.attach(tips[arm], (module, inner));
        tips[arm] = (module, outer);
    }
    builder.0
}

fn human(modules: usize) -> Wiring {
    let mut builder = Builder(Wiring::new(modules));
    let pelvis = modules.saturating_sub(3);
    for bearer in [0, pelvis] {
        builder.attach((bearer, Left), (bearer + 1, Back));
        builder.attach((bearer, Right), (bearer + 2, Back));
    }
    let mut last = 0;
    for module in 3..=pelvis {
        builder.attach((last, Back), (module, Front));
        last = module;
    }
    builder.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use hormone::module_type::ModuleType;

    fn count(wiring: &Wiring, wanted: ModuleType) -> usize {
        (0..wiring.modules()).filter(|&module| wiring.module_type(module) == wanted).count()
    }

    #[test]
    fn a_centipede_of_100_is_the_papers() {
        use ModuleType::{Branch, Head, LeftLeg, Other, RightLeg, Spine, Tail};
        let wiring = Shape::Centipede.wiring(100).unwrap();
        let counts = [Head, Branch, LeftLeg, RightLeg, Spine, Tail, Other].map(|of| count(&wiring, of));
        assert_eq!(counts, [1, 24, 24, 24, 26, 1, 0]);
        assert_eq!(wiring.attachments().count(), 99);
    }

    #[test]
    fn every_centipede_is_whole_and_has_as_many_branches_as_promised() {
        for modules in 2..=300 {
            let wiring = Shape::Centipede.wiring(modules).unwrap();
            assert_eq!(wiring.modules(), modules);
            assert_eq!(wiring.attachments().count(), modules - 1, "a tree of {modules}");
            assert_eq!(count(&wiring, ModuleType::Branch), (modules - 2) / 4, "{modules}");
            assert_eq!(count(&wiring, ModuleType::Other), 0);
        }
    }

    /// By index, as head, branch, left leg, right leg, spine or tail.
    #[test]
    fn modules_are_numbered_from_head_to_tail_and_a_spine_follows_each_branch_while_there_is_one() {
        for (shape, types) in [
            (Shape::Centipede, "HT"),
            (Shape::Centipede, "HSSST"),
            (Shape::Centipede, "HBLRST"),
            (Shape::Centipede, "HBLRSSSST"),
            (Shape::Centipede, "HBLRSBLRST"),
            (Shape::FourLegs, "HBLRBLRT"),
            (Shape::FourLegs, "HBLRSBLRT"),
            (Shape::FourLegs, "HBLRSBLRSST"),
            (Shape::SixLegs, "HBLRSBLRSBLRT"),
            (Shape::Chain, "HSSSSSST"),
        ] {
            let wiring = shape.wiring(types.len()).unwrap();
            let letter = |module| match wiring.module_type(module) {
                ModuleType::Head => 'H',
                ModuleType::Branch => 'B',
                ModuleType::LeftLeg => 'L',
                ModuleType::RightLeg => 'R',
                ModuleType::Spine => 'S',
                ModuleType::Tail => 'T',
                _ => '?',
            };
            assert_eq!((0..types.len()).map(letter).collect::<String>(), types, "{shape:?}");
        }
    }

    #[test]
    fn a_module_alone_is_a_chain() {
        assert_eq!(Shape::Chain.wiring(1).unwrap(), Wiring::new(1));
    }

    #[test]
    fn legged_robots_have_their_legs() {
        for (shape, branches) in [(Shape::FourLegs, 2), (Shape::SixLegs, 3)] {
            for more in 0..5 {
                let wiring = shape.wiring(shape.usual_modules() + more).unwrap();
                assert_eq!(count(&wiring, ModuleType::LeftLeg), branches);
                assert_eq!(count(&wiring, ModuleType::RightLeg), branches);
                assert_eq!(count(&wiring, ModuleType::Other), 0);
            }
        }
        assert_eq!(Shape::SixLegs.wiring(10), Err(TooFewModules { least: 11 }));
    }

    #[test]
    fn a_cross_has_one_head_and_a_pair_of_arms_unless_it_is_asked_for_more() {
        let cross = Shape::Cross.wiring(Shape::Cross.usual_modules()).unwrap();
        use ModuleType::{Branch, Head, LeftLeg, RightLeg, Tail};
        assert_eq!([Head, Branch, LeftLeg, RightLeg, Tail].map(|of| count(&cross, of)), [1; 5]);
    }

    #[test]
    fn a_human_has_arms_and_legs_whatever_the_length_of_its_trunk() {
        use ModuleType::{Branch, Head, LeftLeg, Other, RightLeg, Spine};
        for modules in 6..12 {
            let human = Shape::Human.wiring(modules).unwrap();
            assert_eq!(human.body(0).len(), modules);
            let counts = [LeftLeg, RightLeg, Spine, Other].map(|of| count(&human, of));
            assert_eq!(counts, [2, 2, modules - 6, 2], "{modules}");
            let acting = |module: usize| ModuleType::acting(&human.neighbours(module));
            assert_eq!([acting(0), acting(modules - 3)], [Head, Branch], "{modules}");
        }
        assert_eq!(Shape::Human.wiring(5), Err(TooFewModules { least: 6 }));
    }

    #[test]
    fn a_ring_has_no_end_and_a_cross_four() {
        let ring = Shape::Ring.wiring(6).unwrap();
        assert_eq!(count(&ring, ModuleType::Spine), 6);
        let cross = Shape::Cross.wiring(10).unwrap();
        let ends = (0..10).filter(|&module| cross.neighbours(module).iter().flatten().count() == 1);
        assert_eq!(ends.count(), 4);
        let arms: Vec<_> = cross.attachments().map(|(one, other)| format!("{one} {other}")).collect();
        assert_eq!(
            arms,
            [
                "0.Front 1.Back",
                "0.Back 2.Front",
                "0.Left 3.Back",
                "0.Right 4.Back",
                "1.Front 5.Back",
                "2.Back 6.Front",
                "3.Front 7.Back",
                "4.Front 8.Back",
                "5.Front 9.Back",
            ]
        );
        assert_eq!(cross.neighbours(0), [Some(Back), Some(Front), Some(Back), Some(Back), None, None]);
    }
}
