//! The step loop: timed without anything else, and recorded in a run of its own.

use crate::answer::{Failure, RunAnswer};
use crate::clock::{self, Spread, Times};
use crate::fmi3::{Fault, Fmi};
use crate::job::Job;

/// Loads the FMU and hands it to `work`; a fault takes the FMU's messages along.
pub(crate) fn with_fmu<T>(
    job: &Job,
    work: impl FnOnce(&Fmi) -> Result<T, Fault>,
) -> Result<(T, Vec<String>), Failure> {
    let fmi = Fmi::instantiate(&job.library, &job.token, job.resources.as_deref())
        .map_err(|e| Failure::load(&e))?;
    let result = work(&fmi).and_then(|result| fmi.terminate().map(|()| result));
    match result {
        Ok(result) => Ok((result, fmi.messages())),
        Err(fault) => Err(Failure::call(fault, &fmi)),
    }
}

/// Makes an instance ready for its first step.
pub(crate) fn prepare(fmi: &Fmi, job: &Job) -> Result<(), Fault> {
    fmi.set(&job.set)?;
    fmi.initialise(job.start, job.stop)
}

/// The bare step loop.
#[inline]
pub(crate) fn steps(fmi: &Fmi, points: &[f64]) -> Result<(), Fault> {
    points.windows(2).try_for_each(|p| fmi.step(p[0], p[1] - p[0]))
}

/// Times the loop, counts, records.
pub(crate) fn run(job: &Job) -> Result<RunAnswer, Failure> {
    let points = job.points();
    let own_cost = clock::own_cost();
    let (answer, messages) = with_fmu(job, |fmi| {
        // the first run is dropped, but for its counters
        prepare(fmi, job)?;
        steps(fmi, &points)?;
        let mut counts = vec![0; job.count.len()];
        fmi.get_int64(&job.count, &mut counts)?;

        let samples = if job.sample_every > 0 { record(fmi, job, &points)? } else { Vec::new() };

        let mut runs = 0;
        let mut measured = Vec::with_capacity(job.repeat);
        for _ in 0..job.repeat {
            let (times, n) =
                clock::repeated(job.min_time, own_cost, || timed(fmi, job, || steps(fmi, &points)))?;
            measured.push(times);
            runs += n;
        }
        let cpu = Spread::of(measured.iter().map(|t| t.cpu));
        let wall = Spread::of(measured.iter().map(|t| t.wall));
        Ok(RunAnswer {
            status: "OK",
            cpu_min: cpu.min,
            cpu_median: cpu.median,
            wall_min: wall.min,
            wall_median: wall.median,
            runs,
            steps: points.len() - 1,
            counts,
            samples,
            messages: Vec::new(),
        })
    })?;
    Ok(RunAnswer { messages, ..answer })
}

/// Starts afresh, untimed, and times `section`.
pub(crate) fn timed(
    fmi: &Fmi,
    job: &Job,
    section: impl FnOnce() -> Result<(), Fault>,
) -> Result<Times, Fault> {
    fmi.reset()?;
    prepare(fmi, job)?;
    let (times, result) = clock::time(section);
    result.map(|()| times)
}

/// Rows of time and values at every `sample_every`-th communication point, the first and the last included.
fn record(fmi: &Fmi, job: &Job, points: &[f64]) -> Result<Vec<Vec<f64>>, Fault> {
    let row = |t: f64| {
        let mut row = vec![t; 1 + job.get.len()];
        fmi.get_float64(&job.get, &mut row[1..])?;
        Ok(row)
    };
    fmi.reset()?;
    prepare(fmi, job)?;
    let mut samples = vec![row(points[0])?];
    for (i, p) in points.windows(2).enumerate() {
        fmi.step(p[0], p[1] - p[0])?;
        if (i + 1) % job.sample_every == 0 || i + 2 == points.len() {
            samples.push(row(p[1])?);
        }
    }
    Ok(samples)
}
