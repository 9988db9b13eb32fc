//! The results of a campaign's runs, each as a row of named figures.

use std::collections::BTreeSet;
use std::error::Error;
use std::fs;
use std::path::Path;

use serde_json::{Map, Value};

use super::jobs;
use super::plan::{Plan, Planned};

/// Figures by their names, in the order of a report.
pub type Row = Map<String, Value>;

/// A run and its result.
pub struct Outcome<'a> {
    pub run: &'a Planned,
    /// Its report, if there is one.
    report: Option<Row>,
    /// The exit status: 0; 1 for a robot with faults; or, for a run without a report, the status that the
    /// shell saw. `None` for a run that was not run, or not to its end.
    pub status: Option<i64>,
    /// Why it failed, a line each.
    pub faults: Vec<String>,
}

/// The results of the runs of `plan` so far, in the order of the plan.
///
/// # Errors
/// A report can't be read, or is not one.
pub fn read<'a>(directory: &Path, plan: &'a Plan) -> Result<Vec<Outcome<'a>>, Box<dyn Error>> {
    let results = jobs::results(directory);
    let mut outcomes: Vec<_> =
        plan.runs.iter().map(|run| Outcome::read(run, &results)).collect::<Result<_, _>>()?;
    // A type that a report does not list has no modules in that run.
    let types: BTreeSet<String> =
        outcomes.iter_mut().flat_map(Outcome::types).flat_map(|it| it.keys().cloned()).collect();
    for known in outcomes.iter_mut().flat_map(Outcome::types) {
        for name in &types {
            known.entry(name).or_insert(0.into());
        }
    }
    Ok(outcomes)
}

impl<'a> Outcome<'a> {
    fn read(run: &'a Planned, results: &Path) -> Result<Self, Box<dyn Error>> {
        let file = |end: &str| results.join(format!("{}.{end}", run.key));
        let path = file("json");
        if !path.exists() {
            let status = fs::read_to_string(file("status")).ok().and_then(|text| text.trim().parse().ok());
            // A run that ends with 1 leaves a report. If the report was removed, the run is still to be
            // repeated.
            let status = status.filter(|&status| status != 1);
            let said = fs::read(file("err")).unwrap_or_default();
            let said = String::from_utf8_lossy(&said);
            let faults = said.lines().filter(|line| status.is_some() && !line.is_empty());
            return Ok(Outcome { run, report: None, status, faults: faults.map(str::to_owned).collect() });
        }
        let text = super::read(&path)?;
        let none = || format!("{} is not a report: remove it, and run its job again", path.display());
        let report: Map<String, Value> = serde_json::from_str(&text).map_err(|_| none())?;
        let faults = report.get("faults").and_then(Value::as_array).ok_or_else(none)?;
        let faults: Vec<_> = faults.iter().filter_map(Value::as_str).map(str::to_owned).collect();
        Ok(Outcome { run, report: Some(report), status: Some(i64::from(!faults.is_empty())), faults })
    }

    /// The modules by their types, if it has a report.
    fn types(&mut self) -> Option<&mut Row> {
        self.report.as_mut()?.get_mut("types")?.as_object_mut()
    }

    /// Whether it has a report.
    pub fn is_done(&self) -> bool {
        self.report.is_some()
    }

    pub fn has_failed(&self) -> bool {
        self.status.is_some_and(|status| status != 0)
    }

    /// All that is known of the run: its name, its parameters, its exit status and the figures of its report.
    ///
    /// # Errors
    /// None: parameters can always be converted.
    pub fn row(&self) -> Result<Row, Box<dyn Error>> {
        let mut row = Row::new();
        row.insert("run".into(), self.run.key.clone().into());
        flatten("", &serde_json::to_value(&self.run.parameters)?, &mut row);
        row.insert("exit_status".into(), self.status.into());
        if let Some(report) = &self.report {
            let mut figures = Row::new();
            flatten("", &Value::Object(report.clone()), &mut figures);
            for (name, value) in figures {
                // Parameters that the report repeats are in the row already.
                row.entry(name).or_insert(value);
            }
        }
        Ok(row)
    }
}

/// Puts the parts of `value` into `row`: fields of an object by `name.field`, the list of faults as a text,
/// and any other list as the number of its elements.
fn flatten(name: &str, value: &Value, row: &mut Row) {
    match value {
        Value::Object(fields) => {
            for (field, value) in fields {
                let name = if name.is_empty() { field.clone() } else { format!("{name}.{field}") };
                flatten(&name, value, row);
            }
        }
        Value::Array(values) => {
            let texts: Option<Vec<_>> = values.iter().map(Value::as_str).collect();
            let cell = match texts {
                Some(texts) if name == "faults" => texts.join("; ").into(),
                _ => values.len().into(),
            };
            row.insert(name.into(), cell);
        }
        value => {
            row.insert(name.into(), value.clone());
        }
    }
}

/// The names in any of `rows`, in the order of their first occurrence. A name without a value in any row is
/// left out if some row has fields of it.
pub fn columns(rows: &[Row]) -> Vec<String> {
    let mut columns: Map<String, Value> = Map::new();
    for (name, value) in rows.iter().flatten() {
        let has_value = columns.entry(name.clone()).or_insert(false.into());
        *has_value = (*has_value == true || !value.is_null()).into();
    }
    let is_object = |name: &str| columns.keys().any(|other| other.starts_with(&format!("{name}.")));
    let kept = columns.iter().filter(|(name, has_value)| **has_value == true || !is_object(name));
    kept.map(|(name, _)| name.clone()).collect()
}

/// A value as a cell of a table. A missing value gives an empty cell.
pub fn cell(value: Option<&Value>) -> String {
    match value {
        None | Some(Value::Null) => String::new(),
        Some(Value::String(text)) => text.clone(),
        // 60.0 is written as 60.
        Some(Value::Number(number)) if number.is_f64() => number.as_f64().unwrap_or_default().to_string(),
        Some(value) => value.to_string(),
    }
}

/// `rows` as CSV (RFC 4180).
///
/// # Errors
/// None: writing to memory does not fail.
pub fn csv(columns: &[String], rows: &[Row]) -> Result<String, Box<dyn Error>> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(columns)?;
    for row in rows {
        writer.write_record(columns.iter().map(|column| cell(row.get(column))))?;
    }
    Ok(String::from_utf8(writer.into_inner()?)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn flat(value: Value) -> Row {
        let mut row = Row::new();
        flatten("", &value, &mut row);
        row
    }

    #[test]
    fn a_report_becomes_a_row_of_figures() {
        let report = json!({
            "cpu": { "master": { "mean": 0.25 }, "slave": null },
            "types": {}, "faults": ["late, by a beat", "lost"], "consoles": [{ "at": 1 }], "right": true
        });
        let row = flat(report);
        let names: Vec<_> = row.keys().map(String::as_str).collect();
        assert_eq!(names, ["cpu.master.mean", "cpu.slave", "faults", "consoles", "right"]);
        let rows = [row];
        let columns = columns(&rows);
        let text = csv(&columns, &rows).unwrap();
        let expected =
            "cpu.master.mean,cpu.slave,faults,consoles,right\n0.25,,\"late, by a beat; lost\",1,true\n";
        assert_eq!(text, expected);
    }

    #[test]
    fn rows_with_different_figures_share_a_table() {
        let rows =
            [flat(json!({ "hop": null, "n": null })), flat(json!({ "hop": { "mean": 3 }, "n": null }))];
        assert_eq!(columns(&rows), ["n", "hop.mean"]);
        assert_eq!(csv(&columns(&rows), &rows).unwrap(), "n,hop.mean\n,\n,3\n");
    }
}
