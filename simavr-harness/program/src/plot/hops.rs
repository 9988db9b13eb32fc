//! Plots how long hormones take, by the number of hops.

use std::error::Error;
use std::path::Path;

use hormone::event::Event;
use simavr_harness::{CLOCK_HZ, Engine, RobotBuilder, Wiring};
use simulation::{Face, MILLISECOND, Robot, Shape, TraceEvent};

use crate::arguments::CoreName;
use crate::chart::{Chart, Curve, Point};
use crate::images::load_images;
use crate::scenario::POWER_UP_WITHIN;

const MODULES: usize = 30;

/// The time until which modules find each other, and the time for which hormones are then followed, in s.
const FOUND: u64 = 2;
const FOLLOWED: u64 = 20;

/// The hormone that a module took up last: the cycle at which it was generated, and the hops since then.
type Taken = Option<(u64, usize)>;

pub fn plot(images: &Path, threads: usize) -> Result<String, Box<dyn Error>> {
    let images = load_images(images, CoreName::Decoded)?;
    let wiring = Shape::Chain.wiring(MODULES)?;
    let robot = RobotBuilder::wired(images, &wiring).seed(1).power_up_within(POWER_UP_WITHIN).build()?;
    let mut engine = Engine::new(robot, threads);
    engine.run_until(FOUND * 1000 * MILLISECOND);
    Robot::take_trace_events(&mut engine);
    engine.run_until((FOUND + FOLLOWED) * 1000 * MILLISECOND);
    let took = took(&Robot::take_trace_events(&mut engine), &wiring);
    let points: Vec<Point> = took.iter().enumerate().filter_map(|(hops, took)| point(hops, took)).collect();
    let curves = [Curve { label: String::new(), points }];
    let x = "hops from where a hormone was generated";
    Chart { x, y: "mean, least and most, ms", curves: &curves, has_dots: true }.svg()
}

/// By hops, the cycles that each hormone took since it was generated.
fn took(trace_events: &[TraceEvent], wiring: &Wiring) -> Vec<Vec<u64>> {
    let mut last: Vec<Taken> = vec![None; wiring.modules()];
    let mut took: Vec<Vec<u64>> = Vec::new();
    for &TraceEvent { cycle, module, event } in trace_events {
        match event {
            Event::HormoneGenerated(_) => last[module] = Some((cycle, 0)),
            Event::HormoneReceived(dock, _) => {
                let from = wiring.peer(Face { module, dock }).and_then(|peer| last[peer.module]);
                last[module] = from.map(|(generated, hops)| (generated, hops + 1));
                let Some((generated, hops)) = last[module] else { continue };
                took.resize_with(took.len().max(hops + 1), Vec::new);
                took[hops].push(cycle - generated);
            }
            _ => {}
        }
    }
    took
}

fn point(hops: usize, took: &[u64]) -> Option<Point> {
    let ms = |cycles: u64| cycles as f64 * 1000.0 / f64::from(CLOCK_HZ);
    let (low, high) = (ms(*took.iter().min()?), ms(*took.iter().max()?));
    let mean = ms(took.iter().sum()) / took.len() as f64;
    Some(Point { x: hops as f64, y: mean, low, high })
}

#[cfg(test)]
mod tests {
    use super::*;
    use hormone::hormone::Data;
    use tasks::dock::Dock;

    #[test]
    fn a_hormone_is_followed_from_where_it_was_generated() {
        let wiring = Shape::Chain.wiring(3).unwrap();
        let behind = wiring.peer(Face { module: 0, dock: Dock::Back }).unwrap();
        let last = wiring.peer(Face { module: behind.module, dock: Dock::Back }).unwrap();
        let trace_event = |cycle, module, event| TraceEvent { cycle, module, event };
        let trace_events = [
            trace_event(50, behind.module, Event::HormoneReceived(behind.dock, Data::A)),
            trace_event(100, 0, Event::HormoneGenerated(Data::B)),
            trace_event(130, behind.module, Event::HormoneReceived(behind.dock, Data::B)),
            trace_event(170, last.module, Event::HormoneReceived(last.dock, Data::B)),
        ];
        assert_eq!(took(&trace_events, &wiring), [vec![], vec![30], vec![70]]);
    }
}
