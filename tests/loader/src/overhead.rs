//! What single calls cost.

use crate::answer::{Failure, OverheadAnswer, PerCall};
use crate::clock::{self, Spread, Times};
use crate::fmi3::Fault;
use crate::job::Job;
use crate::run::{prepare, steps, timed, with_fmu};

/// Calls of Get and Set between two looks at the clock.
const BATCH: u32 = 1000;

/// Times `fmi3DoStep`, Get and Set, alone and together; the smallest of all measurements counts, in CPU time.
pub(crate) fn overhead(job: &Job) -> Result<OverheadAnswer, Failure> {
    let points = job.points();
    let own_cost = clock::own_cost();
    let (answer, messages) = with_fmu(job, |fmi| {
        let mut values = vec![0.0; job.get.len()];
        let mut inputs = vec![0.0; job.input_vrs.len()];
        let mut sections = 0;
        // smallest CPU time of one section [ns]
        let mut least = |section: &mut dyn FnMut() -> Result<Times, Fault>| {
            let mut measured = Vec::with_capacity(job.repeat);
            for _ in 0..job.repeat {
                let (times, n) = clock::repeated(job.min_time, own_cost, &mut *section)?;
                measured.push(times.cpu);
                sections += n;
            }
            Ok(1e9 * Spread::of(measured).min)
        };
        let n = points.windows(2).map(|_| 1.0).sum::<f64>();

        prepare(fmi, job)?;
        steps(fmi, &points)?; // dropped
        let step_ns = least(&mut || timed(fmi, job, || steps(fmi, &points)))? / n;
        let step_get_ns = least(&mut || {
            timed(fmi, job, || {
                points.windows(2).try_for_each(|p| {
                    fmi.step(p[0], p[1] - p[0])?;
                    fmi.get_float64(&job.get, &mut values)
                })
            })
        })? / n;

        let mut batch = |call: &mut dyn FnMut() -> Result<(), Fault>, values: usize| {
            if values == 0 {
                return Ok(None);
            }
            let per_call = least(&mut || {
                let (times, result) = clock::time(|| (0..BATCH).try_for_each(|_| call()));
                result.map(|()| times)
            })? / f64::from(BATCH);
            #[allow(clippy::cast_precision_loss, reason = "a number of variables")]
            let per_value = per_call / values as f64;
            Ok(Some(PerCall { per_call, per_value }))
        };
        fmi.get_float64(&job.input_vrs, &mut inputs)?;
        let get_ns = batch(&mut || fmi.get_float64(&job.get, &mut values), job.get.len())?;
        let set_ns = batch(&mut || fmi.set_float64(&job.input_vrs, &inputs), job.input_vrs.len())?;
        Ok(OverheadAnswer {
            status: "OK",
            steps: points.len() - 1,
            sections,
            step_ns,
            step_get_ns,
            get_ns,
            set_ns,
            messages: Vec::new(),
        })
    })?;
    Ok(OverheadAnswer { messages, ..answer })
}
