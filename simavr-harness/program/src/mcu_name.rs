//! The name of an MCU on the command line: `3.slave`.

use std::fmt;
use std::str::FromStr;

use simavr_harness::Controller;

/// An MCU of a robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct McuName {
    pub module: usize,
    pub controller: Controller,
}

impl FromStr for McuName {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let named = text.split_once('.').and_then(|(module, controller)| {
            let controller = match controller {
                "master" => Controller::Master,
                "slave" => Controller::Slave,
                _ => return None,
            };
            Some(McuName { module: module.parse().ok()?, controller })
        });
        named.ok_or("name an MCU by its module's number and master or slave, as in 0.master or 3.slave")
    }
}

impl fmt::Display for McuName {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let controller = match self.controller {
            Controller::Master => "master",
            Controller::Slave => "slave",
        };
        write!(f, "{}.{controller}", self.module)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_as_they_are_written() {
        for text in ["0.master", "17.slave"] {
            assert_eq!(text.parse::<McuName>().map(|name| name.to_string()), Ok(text.into()));
        }
        for text in ["", "0", "master", "0.", ".master", "-1.slave", "0.Master", "0.master.1", "x.slave"] {
            assert!(text.parse::<McuName>().is_err(), "{text}");
        }
    }
}
