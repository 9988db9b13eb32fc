//! What can be asked of campaigns on the command line.

use std::path::PathBuf;

use clap::Args;

#[derive(Args)]
pub struct Campaign {
    /// The campaign: a TOML file of options of sim, each with a list of values.
    pub file: PathBuf,

    /// Where its list of jobs and their results go.
    #[arg(value_name = "DIR")]
    pub directory: PathBuf,

    /// Run the jobs here and now, by GNU parallel or else by xargs; those that are done are not run again.
    #[arg(long)]
    pub run: bool,

    /// How many jobs run at once. As many as the machine has cores, unless given.
    #[arg(long, value_name = "N", value_parser = jobs, allow_hyphen_values = true)]
    pub jobs: Option<usize>,

    /// The directory with firmware-master.elf and firmware-slave.elf, as `./x build` leaves them.
    #[arg(long, value_name = "DIRECTORY", env = "SUPERBOT_IMAGES", default_value = "target/images")]
    pub images: PathBuf,
}

#[derive(Args)]
pub struct CampaignReport {
    /// The campaign's directory. runs.csv and summary.csv are written there.
    #[arg(value_name = "DIR")]
    pub directory: PathBuf,

    /// Plot this figure, too: a column of runs.csv that has numbers, or failed.
    #[arg(long, value_name = "FIGURE", requires = "against", requires = "svg")]
    pub plot: Option<String>,

    /// Against what: loss, modules, seconds or seed.
    #[arg(long, value_name = "PARAMETER", requires = "plot")]
    pub against: Option<String>,

    /// Plot it to this file.
    #[arg(long, value_name = "FILE", requires = "plot")]
    pub svg: Option<String>,
}

fn jobs(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(jobs @ 1..=1024) => Ok(jobs),
        _ => Err("give a number of jobs from 1 to 1024".into()),
    }
}
