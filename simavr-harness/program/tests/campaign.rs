//! Tests campaigns and their reports, as `./x campaign` and `./x report` run them.

mod command;

use std::fs;
use std::os::unix::fs::symlink;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::Duration;

use command::run;
use tempfile::TempDir;

/// Eight runs: a chain walks, and a robot of one module, which has no head, does not.
const FILE: &str = "
robot = { shape = 'chain', modules = [1, 5] }
engine = 'host'
seconds = 2
loss = [0, 0.1]
seed = { from = 1, to = 2 }
";

struct Campaign(TempDir);

impl Campaign {
    /// A campaign in a directory whose name a shell would split.
    fn of(text: &str) -> Self {
        let campaign = Campaign(tempfile::tempdir().unwrap());
        fs::write(campaign.path("campaign.toml"), text).unwrap();
        campaign
    }

    fn path(&self, name: &str) -> String {
        self.0.path().join(name).to_str().unwrap().into()
    }

    fn directory(&self) -> String {
        self.path("it's a $campaign")
    }

    fn file(&self, name: &str) -> String {
        fs::read_to_string(Path::new(&self.directory()).join(name)).unwrap()
    }

    fn plan(&self, arguments: &[&str]) -> Output {
        run(&[&["campaign", &self.path("campaign.toml"), &self.directory()], arguments].concat())
    }

    fn report(&self, arguments: &[&str]) -> Output {
        run(&[&["report", &self.directory()], arguments].concat())
    }

    /// The names of the results, and the time at which each was written.
    fn results(&self) -> Vec<(String, std::time::SystemTime)> {
        let files = fs::read_dir(Path::new(&self.directory()).join("runs")).unwrap().map(Result::unwrap);
        let mut results: Vec<_> = files
            .map(|file| {
                (file.file_name().into_string().unwrap(), file.metadata().unwrap().modified().unwrap())
            })
            .filter(|(name, _)| name.ends_with(".json"))
            .collect();
        results.sort();
        results
    }

    /// The lines of the table, each as a function from the name of a column to its cell.
    fn rows(&self, name: &str) -> Vec<impl Fn(&str) -> String> {
        let text = self.file(name);
        let mut table = csv::Reader::from_reader(text.as_bytes());
        let heading = table.headers().unwrap().clone();
        let row = |cells: Result<csv::StringRecord, _>| {
            let (heading, cells) = (heading.clone(), cells.unwrap());
            move |name: &str| cells[heading.iter().position(|column| column == name).expect(name)].to_owned()
        };
        table.records().map(row).collect()
    }
}

fn shell(command: &str) -> Output {
    Command::new("sh").args(["-c", command]).output().expect("there is a shell")
}

fn said(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap() + &String::from_utf8_lossy(&output.stderr)
}

#[test]
fn a_campaign_goes_on_where_it_was_and_tells_what_failed() {
    let campaign = Campaign::of(FILE);
    let planned = campaign.plan(&[]);
    assert_eq!(planned.status.code(), Some(0), "{}", said(&planned));
    assert!(said(&planned).contains("runs: 8, done: 0"), "{}", said(&planned));

    // Three jobs are done before the campaign is interrupted.
    let jobs = campaign.file("jobs");
    let lines: Vec<_> = jobs.lines().collect();
    assert_eq!(lines.len(), 8);
    // A job fails if its run fails.
    assert!(!shell(lines[0]).status.success());
    assert!(shell(lines[4]).status.success() && shell(lines[7]).status.success());
    let first = campaign.results();
    assert_eq!(first.len(), 3);
    let report = said(&campaign.report(&[]));
    assert!(report.contains("still to run: 5") && report.contains("1 of 2"), "{report}");

    let resumed = campaign.plan(&["--run", "--jobs", "2"]);
    assert_eq!(resumed.status.code(), Some(1), "{}", said(&resumed));
    assert!(said(&resumed).contains("runs: 8, done: 8, failed: 4"), "{}", said(&resumed));
    let results = campaign.results();
    assert_eq!(results.len(), 8);
    assert!(first.iter().all(|result| results.contains(result)), "none is run twice");

    let report = campaign.report(&[]);
    assert_eq!(report.status.code(), Some(0), "{}", said(&report));
    let report = said(&report);
    assert!(report.contains("| 1 | 0.1 | 2 | 2 | 34.2 to 100.0 |"), "{report}");
    assert!(report.contains("| 5 | 0 | 2 | 0 | 0.0 to 65.8 |"), "{report}");
    let (runs, summary) = (campaign.rows("runs.csv"), campaign.rows("summary.csv"));
    assert_eq!((runs.len(), summary.len()), (8, 4));
    for run in &runs {
        assert_eq!(run("exit_status"), if run("modules") == "1" { "1" } else { "0" });
        assert_eq!(run("hop_latency_us.mean").is_empty(), run("modules") == "1");
        assert_eq!(run("types.Head"), if run("modules") == "1" { "0" } else { "1" });
    }
    assert_eq!((summary[3]("done"), summary[3]("failed")), ("2".into(), "0".into()));

    // The report has the command of each failed run, which reproduces the failure.
    let told: Vec<_> = report.lines().filter_map(|line| line.strip_prefix("exit status 1: ")).collect();
    assert_eq!(told.len(), 4, "{report}");
    let again = shell(told[0]);
    assert_eq!(again.status.code(), Some(1));
    let fault = report.lines().skip_while(|line| !line.contains(told[0])).nth(1).unwrap().trim();
    assert!(String::from_utf8_lossy(&again.stderr).contains(fault), "{fault}: {}", said(&again));
    let run = Path::new(&campaign.directory()).join("runs").join(runs[0]("run"));
    assert!(fs::read_to_string(format!("{}.err", run.display())).unwrap().contains(fault));
}

#[test]
fn a_run_that_is_killed_leaves_no_result_and_is_run_again() {
    // The run takes seconds, so it is still running when it is killed.
    let campaign = Campaign::of("robot = 'chain'\nengine = 'host'\nseconds = 1500");
    let (file, directory) = (campaign.path("campaign.toml"), campaign.directory());
    let mut running = Command::new(env!("CARGO_BIN_EXE_superbot-sim"))
        .args(["campaign", &file, &directory, "--run"])
        .process_group(0)
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let begun = Path::new(&directory).join("runs/chain-5.host.none.1500s.loss-0.seed-1.err");
    while !begun.exists() {
        assert!(running.try_wait().unwrap().is_none(), "it has ended");
        std::thread::sleep(Duration::from_millis(10));
    }
    assert!(shell(&format!("kill -KILL -{}", running.id())).status.success());
    running.wait().unwrap();
    assert!(campaign.results().is_empty());
    let report = campaign.report(&[]);
    assert!(said(&report).contains("still to run: 1"), "{}", said(&report));
    assert_eq!(campaign.plan(&["--run"]).status.code(), Some(0));
    assert_eq!(campaign.results().len(), 1);
}

#[test]
fn how_a_run_ended_before_is_not_told_of_one_that_is_still_to_be_made() {
    let is_to_run = |campaign: &Campaign| {
        let report = said(&campaign.report(&[]));
        assert!(report.contains("still to run: 1") && !report.contains("exit status"), "{report}");
    };
    // First the run is refused. Then it is possible, and a signal ends it.
    let campaign = Campaign::of("robot = 'one.toml'\nengine = 'host'\nseconds = 86400");
    let robot = campaign.path("one.toml");
    fs::write(&robot, "modules = 1").unwrap();
    campaign.plan(&[]);
    fs::write(&robot, "modules = 0").unwrap();
    assert!(!shell(&campaign.file("jobs")).status.success());
    assert!(said(&campaign.report(&[])).contains("exit status 2: "));
    fs::write(&robot, "modules = 1").unwrap();
    let mut job = Command::new("sh");
    let mut job = job.args(["-c", &campaign.file("jobs")]).process_group(0).spawn().unwrap();
    let of_before = || {
        let mut files = fs::read_dir(Path::new(&campaign.directory()).join("runs")).unwrap();
        files.any(|file| file.unwrap().path().extension().is_some_and(|end| end == "status"))
    };
    while of_before() {
        assert!(job.try_wait().unwrap().is_none(), "it has ended");
        std::thread::sleep(Duration::from_millis(10));
    }
    assert!(shell(&format!("kill -KILL -{}", job.id())).status.success());
    job.wait().unwrap();
    is_to_run(&campaign);

    // A robot of one module has no head and fails. Then its result is removed.
    let campaign = Campaign::of("robot = { shape = 'chain', modules = 1 }\nengine = 'host'\nseconds = 2");
    assert_eq!(campaign.plan(&["--run"]).status.code(), Some(1));
    let result = &campaign.results()[0].0;
    fs::remove_file(Path::new(&campaign.directory()).join("runs").join(result)).unwrap();
    is_to_run(&campaign);
    assert!(said(&campaign.plan(&[])).contains("runs: 1, done: 0, failed: 0"));
}

#[test]
fn a_result_that_was_removed_is_made_again() {
    let campaign = Campaign::of("robot = 'chain'\nengine = 'host'\nseconds = 2");
    assert_eq!(campaign.plan(&["--run"]).status.code(), Some(0));
    let name = &campaign.results()[0].0;
    fs::remove_file(Path::new(&campaign.directory()).join("runs").join(name)).unwrap();
    let again = campaign.plan(&["--run"]);
    assert!(said(&again).contains("runs: 1, done: 1"), "{}", said(&again));
    // With a job log, GNU parallel, which may not be installed here, would take the job for done.
    let told = said(&campaign.plan(&[]));
    assert!(told.contains("parallel ") && !told.contains("--joblog"), "{told}");
}

#[test]
fn tasks_of_an_array_do_each_job_once() {
    let campaign = Campaign::of(FILE);
    campaign.plan(&[]);
    for task in 1..=8 {
        let script = Path::new(&campaign.directory()).join("slurm.sh");
        let run =
            Command::new("sh").arg(script).env("SLURM_ARRAY_TASK_ID", task.to_string()).output().unwrap();
        assert_eq!(run.status.success(), task > 4, "{}", said(&run));
        assert_eq!(campaign.results().len(), task);
    }
}

#[test]
fn a_run_that_can_not_be_made_fails_and_is_made_once_it_can() {
    let campaign = Campaign::of("robot = 'two.toml'\nengine = 'host'\nseconds = 2");
    let robot = campaign.path("two.toml");
    let text = "modules = 2\nshape = 'chain'\n";
    fs::write(&robot, text).unwrap();
    campaign.plan(&[]);
    fs::write(&robot, "modules = 0").unwrap();
    assert_eq!(campaign.plan(&["--run"]).status.code(), Some(2), "it is refused beforehand");
    assert!(!shell(&campaign.file("jobs")).status.success());
    let report = said(&campaign.report(&[]));
    assert!(report.contains("exit status 2: ") && report.contains("give a number of modules"), "{report}");
    assert_eq!(campaign.rows("runs.csv")[0]("exit_status"), "2");
    assert_eq!(campaign.rows("summary.csv")[0]("done"), "0");

    fs::write(&robot, text).unwrap();
    let mended = campaign.plan(&["--run"]);
    assert_eq!(mended.status.code(), Some(0), "{}", said(&mended));
    campaign.report(&[]);
    assert_eq!(campaign.rows("runs.csv")[0]("exit_status"), "0");
}

#[test]
fn a_table_that_can_not_be_written_leaves_the_summary() {
    let campaign = Campaign::of("robot = 'chain'\nengine = 'host'\nseconds = 2");
    assert_eq!(campaign.plan(&["--run"]).status.code(), Some(0));
    // In the place of the table.
    fs::create_dir(Path::new(&campaign.directory()).join("runs.csv")).unwrap();
    let report = campaign.report(&[]);
    assert_eq!(report.status.code(), Some(2), "{}", said(&report));
    let text = said(&report);
    assert!(text.contains("| runs | failed |") && text.contains("can't write"), "{text}");
}

#[test]
fn a_campaign_that_grows_keeps_what_is_done() {
    let text =
        |seeds| format!("robot = 'chain'\nengine = 'host'\nseconds = 2\nseed = {{ from = 1, to = {seeds} }}");
    let campaign = Campaign::of(&text(1));
    assert_eq!(campaign.plan(&["--run"]).status.code(), Some(0));
    let before = campaign.results();
    fs::write(campaign.path("campaign.toml"), text(3)).unwrap();
    assert_eq!(campaign.plan(&["--run"]).status.code(), Some(0));
    let results = campaign.results();
    assert!(results.len() == 3 && results.contains(&before[0]));

    let plot = |figure, against| {
        let svg = campaign.path("plot.svg");
        campaign.report(&["--plot", figure, "--against", against, "--svg", &svg])
    };
    assert_eq!(plot("hop_latency_us.mean", "seed").status.code(), Some(0));
    let svg = fs::read_to_string(campaign.path("plot.svg")).unwrap();
    assert_eq!(svg.matches("<circle").count(), 3);
    assert!(svg.contains("hop_latency_us.mean") && svg.contains("prefers-color-scheme: dark"));
    assert_eq!(plot("failed", "loss").status.code(), Some(0));
    for (figure, against, advice) in [
        ("hop_latency", "loss", "no run has a number of that name: give one of failed, "),
        ("failed", "engine", "give one of loss, modules, seconds, seed"),
    ] {
        let output = plot(figure, against);
        assert_eq!(output.status.code(), Some(2));
        assert!(said(&output).contains(advice), "{}", said(&output));
    }

    let result = fs::read_dir(format!("{}/runs", campaign.directory())).unwrap().next().unwrap().unwrap();
    let result = format!("runs/{}", result.file_name().to_str().unwrap());
    for own in ["campaign.json", "jobs", "runs.csv", "summary.csv", &result] {
        let file = format!("{}/{own}", campaign.directory());
        let before = fs::read(&file).unwrap();
        let link = campaign.path("link.svg");
        let _ = fs::remove_file(&link);
        symlink(&file, &link).unwrap();
        for svg in [&file, &link] {
            let output = campaign.report(&["--plot", "failed", "--against", "loss", "--svg", svg]);
            assert_eq!(output.status.code(), Some(2), "{svg}");
            let advice = "belongs to the campaign: give --svg another path";
            assert!(said(&output).contains(advice), "{}", said(&output));
            assert_eq!(fs::read(&file).unwrap(), before, "{own}");
        }
    }
}

#[test]
fn what_is_no_campaign_is_refused_with_advice() {
    let campaign = Campaign::of("engine = 'host'\nlos = 0.1");
    for (output, advice) in [
        (campaign.plan(&[]), "unknown field `los`"),
        (campaign.plan(&["--jobs", "0"]), "give a number of jobs from 1 to 1024"),
        (campaign.report(&[]), "./x campaign FILE.toml DIR writes it"),
        (campaign.report(&["--plot", "failed"]), "--against"),
        (run(&["campaign", "nowhere.toml", &campaign.directory()]), "can't read nowhere.toml"),
    ] {
        assert_eq!(output.status.code(), Some(2), "{}", said(&output));
        assert!(said(&output).contains(advice), "{}", said(&output));
    }
    assert!(!Path::new(&campaign.directory()).exists());
    let campaign = Campaign::of(FILE);
    fs::write(campaign.directory(), "a file").unwrap();
    assert!(said(&campaign.plan(&[])).contains("can't make"), "{}", said(&campaign.plan(&[])));
}

#[test]
fn robot_files_that_can_not_be_built_are_refused_before_anything_is_written() {
    for (robot, advice) in [
        ("[[image]]\nmodules = [0]\nmaster = 'gone.elf'", "gone.elf: `master` and `slave`"),
        ("[world]\nboxes = [{ at_m = [0, 0], size_mm = [100, 100, 100] }]", "module 0 lies where"),
    ] {
        let campaign = Campaign::of("robot = 'robot.toml'\nseed = [1, 2]");
        fs::write(campaign.path("robot.toml"), format!("modules = 1\n{robot}")).unwrap();
        let planned = campaign.plan(&[]);
        assert_eq!(planned.status.code(), Some(2), "{}", said(&planned));
        assert!(said(&planned).contains(advice), "{}", said(&planned));
        assert!(!Path::new(&campaign.directory()).exists());
    }
}

#[test]
fn a_campaign_without_images_is_refused_before_anything_is_written() {
    let campaign = Campaign::of("robot = 'chain'\nengine = ['host', 'simavr']");
    let planned = campaign.plan(&["--images", "no/such/folder"]);
    assert_eq!(planned.status.code(), Some(2), "{}", said(&planned));
    assert!(said(&planned).contains("./x build"), "{}", said(&planned));
    assert!(!Path::new(&campaign.directory()).exists());
}

#[test]
fn a_campaign_file_is_not_overwritten_by_what_the_campaign_writes() {
    let campaign = Campaign::of(FILE);
    fs::create_dir(campaign.directory()).unwrap();
    for name in ["jobs", "campaign.json", "slurm.sh"] {
        let file = format!("{}/{name}", campaign.directory());
        fs::write(&file, FILE).unwrap();
        let refused = run(&["campaign", &file, &campaign.directory()]);
        assert_eq!(refused.status.code(), Some(2), "{name}");
        assert!(said(&refused).contains("the campaign would overwrite"), "{}", said(&refused));
        assert_eq!(campaign.file(name), FILE);
        fs::remove_file(&file).unwrap();
    }
}

/// A job is one line. A shell would take the parts of a longer one for separate commands.
#[test]
fn a_path_with_a_line_break_is_refused() {
    let campaign = Campaign::of("robot = \"a\\nb.toml\"\nengine = 'host'");
    fs::write(campaign.path("a\nb.toml"), "modules = 1").unwrap();
    let plain = Campaign::of("robot = 'chain'\nengine = 'host'");
    let broken = plain.path("a\nb");
    for planned in [campaign.plan(&[]), run(&["campaign", &plain.path("campaign.toml"), &broken])] {
        assert_eq!(planned.status.code(), Some(2), "{}", said(&planned));
        assert!(said(&planned).contains("a job has one line"), "{}", said(&planned));
    }
    assert!(![&campaign.directory(), &broken].into_iter().any(|path| Path::new(path).exists()));
}

#[test]
fn robot_files_have_names_of_all_letters() {
    let campaign = Campaign::of("robot = ['ä.toml', 'ö.toml']\nengine = 'host'");
    for name in ["ä.toml", "ö.toml"] {
        fs::write(campaign.path(name), "modules = 1").unwrap();
    }
    let planned = campaign.plan(&[]);
    assert!(said(&planned).contains("runs: 2, done: 0"), "{}", said(&planned));
}

#[test]
fn robot_files_whose_paths_look_alike_as_names_of_files_have_runs_of_their_own() {
    let long = format!("{0}/{0}/two.toml", "long".repeat(40));
    let robots = ["legs/x.toml", "legs_x.toml", &long];
    let text = |robots: &[&str]| format!("robot = {robots:?}\nengine = 'host'\nseconds = 2");
    let campaign = Campaign::of(&text(&robots[..1]));
    for (name, modules) in robots.iter().zip(2..) {
        let path = campaign.path(name);
        fs::create_dir_all(Path::new(&path).parent().unwrap()).unwrap();
        fs::write(path, format!("modules = {modules}\nshape = 'chain'")).unwrap();
    }
    assert!(said(&campaign.plan(&["--run"])).contains("runs: 1, done: 1, failed: 0"));
    fs::write(campaign.path("campaign.toml"), text(&robots)).unwrap();
    let grown = campaign.plan(&[]);
    assert!(said(&grown).contains("runs: 3, done: 1"), "{}", said(&grown));
    let done = campaign.plan(&["--run"]);
    assert!(said(&done).contains("runs: 3, done: 3, failed: 0"), "{}", said(&done));
}
