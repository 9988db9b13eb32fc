//! What can be asked of campaigns on the command line.

use std::path::PathBuf;

use clap::Args;

#[derive(Args)]
pub struct Campaign {
    /// TOML file of the campaign: options of sim, each with a list of values.
    pub file: PathBuf,

    /// Directory for the list of jobs and their results.
    #[arg(value_name = "DIR")]
    pub directory: PathBuf,

    /// Run the jobs on this machine now, with GNU parallel or else with xargs. Jobs that are done do not run
    /// again.
    #[arg(long)]
    pub run: bool,

    /// Number of jobs that run at once. Default: one for each core.
    #[arg(long, value_name = "N", value_parser = jobs, allow_hyphen_values = true)]
    pub jobs: Option<usize>,

    /// Directory with firmware-master.elf and firmware-slave.elf, which `./x build` writes.
    #[arg(long, value_name = "DIRECTORY", env = "SUPERBOT_IMAGES", default_value = "target/images")]
    pub images: PathBuf,
}

#[derive(Args)]
pub struct CampaignReport {
    /// Directory of the campaign. runs.csv, runs.parquet and summary.csv go there.
    #[arg(value_name = "DIR")]
    pub directory: PathBuf,

    /// Also plot this figure: a column of runs.csv that has numbers, or failed.
    #[arg(long, value_name = "FIGURE", requires = "against", requires = "svg")]
    pub plot: Option<String>,

    /// Parameter to plot the figure against: loss, modules, seconds or seed.
    #[arg(long, value_name = "PARAMETER", requires = "plot")]
    pub against: Option<String>,

    /// SVG file for the plot.
    #[arg(long, value_name = "FILE", requires = "plot")]
    pub svg: Option<String>,
}

fn jobs(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(jobs @ 1..=1024) => Ok(jobs),
        _ => Err("give a number of jobs from 1 to 1024".into()),
    }
}
