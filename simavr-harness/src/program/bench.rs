//! The program behind `./x bench`: the kernel's figures beside those of its peers.

use std::error::Error;
use std::fmt;

use serde::{Serialize, Serializer};
use simavr_harness::bench::{self, FIGURES, Figure, Measured, PEERS};

use super::{arguments, json};

/// Measures and prints.
pub fn run(options: &arguments::Bench) -> Result<(), Box<dyn Error>> {
    let report = Report { measured: bench::measure(&options.images.join("tests"))? };
    match &options.json {
        Some(path) => json::write(&report, path),
        None => {
            print!("{report}");
            Ok(())
        }
    }
}

struct Report {
    measured: Vec<Measured>,
}

impl Report {
    /// Each figure with what was measured of it.
    fn lines(&self) -> impl Iterator<Item = (&'static Figure, Option<&Measured>)> {
        FIGURES.iter().map(|figure| (figure, self.measured.iter().find(|measured| measured.name == figure.name)))
    }
}

/// One object: each figure's name and value, null where there is none yet.
impl Serialize for Report {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer
            .collect_map(self.lines().map(|(figure, measured)| (figure.name, measured.map(|measured| measured.value))))
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{:25}{:>5}  {:13}", "", "here", "to reach")?;
        for peer in PEERS {
            write!(f, "{:>9}", peer.name)?;
        }
        writeln!(f)?;
        for (figure, measured) in self.lines() {
            let (value, verdict) = match measured {
                None => ("-".into(), "not there yet"),
                Some(measured) if measured.value > figure.limit => (measured.value.to_string(), "MISSED"),
                Some(measured) => (measured.value.to_string(), ""),
            };
            write!(f, "{:25}{value:>5}  <= {:4} {verdict:6}", figure.name, figure.limit)?;
            for peer in figure.peers {
                let peer = peer.map_or("-".into(), |value| value.to_string());
                write!(f, "{peer:>9}")?;
            }
            writeln!(f)?;
        }
        writeln!(f)?;
        for measured in &self.measured {
            if let Some(place) = &measured.place {
                writeln!(f, "{}: {place}", measured.name)?;
            }
        }
        writeln!(f, "Peers: {}.", PEERS.map(|peer| peer.version).join("; "))
    }
}
