//! A campaign's directory: the list of jobs, and the commands of the engines that can run it.

use std::error::Error;
use std::ffi::OsStr;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use super::super::json::is_same;
use super::plan::{Plan, Planned};
use super::text;

/// The most tasks of an array that Slurm takes by default (MaxArraySize).
const ARRAY: usize = 1000;

/// The files in a campaign's directory other than the results and the tables.
const LIST: &str = "jobs";
const SLURM: &str = "slurm.sh";
const PLAN: &str = "campaign.json";

/// A list of jobs, and its directory.
pub struct Jobs {
    directory: PathBuf,
    list: String,
    plan: String,
    number: usize,
}

impl Jobs {
    /// The jobs of `plan`, whose results go to `directory`.
    ///
    /// # Errors
    /// The path of the directory, or another one in a job, is not Unicode or has more than one line.
    pub fn new(plan: &Plan, directory: &Path) -> Result<Self, Box<dyn Error>> {
        let directory = std::path::absolute(directory)?;
        let mut list = String::new();
        for run in &plan.runs {
            let job = line(run, &directory)?;
            if job.contains('\n') {
                // A shell would take its lines for separate commands.
                return Err(
                    format!("a job has one line, but a path in this one has a line break: {job}").into()
                );
            }
            writeln!(list, "{job}")?;
        }
        let plan_text = serde_json::to_string_pretty(plan)? + "\n";
        Ok(Jobs { directory, list, plan: plan_text, number: plan.runs.len() })
    }

    /// Writes all files but the results. None of them overwrites the campaign's `file`.
    ///
    /// # Errors
    /// A file can't be written, or would overwrite the campaign's.
    pub fn write(&self, file: &Path) -> Result<(), Box<dyn Error>> {
        let slurm = self.slurm()?;
        let files = [
            (self.list_path(), &self.list),
            (plan_path(&self.directory), &self.plan),
            (self.slurm_path(), &slurm),
        ];
        if files.iter().any(|(path, _)| is_same(path, file)) {
            let file = file.display();
            return Err(format!(
                "the campaign would overwrite {file} with its own file: move it, or name another DIR"
            )
            .into());
        }
        let results = results(&self.directory);
        std::fs::create_dir_all(&results)
            .map_err(|error| format!("can't make {}: {error}", results.display()))?;
        files.iter().try_for_each(|(path, content)| super::write(path, content))
    }

    /// The command by which GNU parallel runs the list, or continues it, with `at_once` jobs at a time or one
    /// for each core. Its record of jobs is not used: a run would count there as done even after its result
    /// was removed.
    pub fn parallel(&self, at_once: Option<usize>) -> Result<Vec<String>, Box<dyn Error>> {
        let mut command: Vec<String> = ["parallel", "--bar"].map(Into::into).into();
        if let Some(at_once) = at_once {
            command.extend(["--jobs".into(), at_once.to_string()]);
        }
        command.extend(["--arg-file".into(), text(&self.list_path())?, "sh".into(), "-c".into()]);
        Ok(command)
    }

    /// The same for xargs, which every Linux has.
    pub fn xargs(&self, at_once: Option<usize>) -> Result<Vec<String>, Box<dyn Error>> {
        let at_once = at_once.unwrap_or_else(super::super::arguments::cores);
        let mut command: Vec<String> =
            ["xargs", "--delimiter", "\\n", "--max-args", "1"].map(Into::into).into();
        command.extend(["--max-procs".into(), at_once.to_string()]);
        command.extend(["--arg-file".into(), text(&self.list_path())?, "sh".into(), "-c".into()]);
        Ok(command)
    }

    /// Advice on what to do next.
    pub fn advice(&self, at_once: Option<usize>) -> Result<String, Box<dyn Error>> {
        let shell = |command: Vec<String>| shlex::try_join(command.iter().map(String::as_str));
        Ok(format!(
            "Start or continue the runs with one of\n  {}\n  {}\n  {}\nand then report them with\n  {}\n",
            shell(self.parallel(at_once)?)?,
            shell(self.xargs(at_once)?)?,
            shell(vec!["sbatch".into(), text(&self.slurm_path())?])?,
            shell(vec!["./x".into(), "report".into(), text(&self.directory)?])?,
        ))
    }

    /// A script for Slurm. The tasks of its array take the lines in turn: each begins at the line of its
    /// number, and advances by the number of tasks.
    fn slurm(&self) -> Result<String, Box<dyn Error>> {
        let last = self.number.min(ARRAY);
        let list = text(&self.list_path())?;
        let list = shlex::try_quote(&list)?;
        Ok(format!(
            "#!/bin/sh\n#SBATCH --array=1-{last}\n#SBATCH --cpus-per-task=1\n#SBATCH --output=/dev/null\n\
             sed -n \"${{SLURM_ARRAY_TASK_ID}}~{last}p\" {list} | sh\n"
        ))
    }

    fn list_path(&self) -> PathBuf {
        self.directory.join(LIST)
    }

    fn slurm_path(&self) -> PathBuf {
        self.directory.join(SLURM)
    }
}

/// The directory of a campaign's results.
pub fn results(directory: &Path) -> PathBuf {
    directory.join("runs")
}

/// The file that keeps a campaign's plan.
pub fn plan_path(directory: &Path) -> PathBuf {
    directory.join(PLAN)
}

/// Whether a file of this name in a campaign's directory is the campaign's own, other than a table.
pub fn is_own(name: &OsStr) -> bool {
    [LIST, SLURM, PLAN].map(OsStr::new).contains(&name)
}

/// A job as a line for a shell. Once its result exists the job does nothing, however often it is run. It
/// fails if the run fails, and then keeps the run's exit status in place of that of an earlier run.
fn line(run: &Planned, directory: &Path) -> Result<String, Box<dyn Error>> {
    let file = |end: &str| {
        let path = text(&results(directory).join(format!("{}.{end}", run.key)))?;
        Ok::<_, Box<dyn Error>>(shlex::try_quote(&path)?.into_owned())
    };
    let [json, said, status] = [file("json")?, file("err")?, file("status")?];
    let command = shlex::try_join(run.command.iter().map(String::as_str))?;
    Ok(format!(
        "test -e {json} || {{ rm -f {status}; {command} --json {json} 2>{said}; }} || \
         {{ echo $? >{status}; false; }}"
    ))
}
