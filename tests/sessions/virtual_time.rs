//! The time convention of a session, in virtual time and to the last bit.

use crate::common::rms_percent;
use crate::session_support::*;
use palpate::Error;
use palpate::devices::{Capabilities, Device, DeviceFault, DeviceState, ToolPath};
use palpate::log::{ForceSample, LogRecord};
use palpate::model::Vec3;
use palpate::model::body::{Body, State};
use palpate::model::contact::{Contact, Law, ToolMotion};
use palpate::model::integrator::Spectrum;
use palpate::model::local::{Feedback, Kind as LocalModelKind};
use palpate::model::simulation::{Simulation, Stepping};
use palpate::runtime::{Nanos, Rate};
use palpate::runtime::{OverrunPolicy, RateGroup};
use palpate::scene::Scene;
use palpate::session::{Session, SessionBuilder, Summary};

const HAPTIC: Rate = Rate::hz(1000);

fn session() -> SessionBuilder {
    Session::builder(block()).path(pressing()).model(LocalModelKind::Patch).friction(0.5).virtual_time().keep_records()
}

fn run(builder: SessionBuilder, seconds: f64) -> Summary {
    let summary = builder.duration_s(seconds).build().unwrap().run().unwrap();
    assert_eq!((&summary.runtime.fault, summary.runtime.lost_records), (&None, 0));
    summary
}

/// The global group with a compute latency in microseconds; its results are late, its releases are not.
fn latency(microseconds: u64) -> RateGroup {
    RateGroup::hz(30).latency(Nanos(microseconds * 1000))
}

#[test]
fn release_0_writes_no_force_and_row_n_ends_at_n_periods() {
    for model in LocalModelKind::ALL {
        let summary = run(session().model(model), 0.25);
        for times in [
            forces(&summary).iter().map(|r| r.time).collect::<Vec<_>>(),
            commands(&summary).iter().map(|r| r.time).collect(),
        ] {
            assert_eq!(times, (1..=250).map(|n| Nanos(n * 1_000_000)).collect::<Vec<_>>(), "{model:?}");
        }
        assert_eq!(summary.runtime.groups[0].released, 251);
    }
}

/// A tool that is glued: no detection hides a shifted tick. Check every force against the model called by hand.
#[test]
fn the_model_sees_the_tool_at_the_scheduled_time_of_each_release() {
    let (body, node, path) = (block(), top(), wiggling());
    let triangle = body.surface().at_node(node)[0];
    let corners = body.surface().triangles[triangle as usize];
    let contact = Contact::glued(triangle, corners.map(|corner| f64::from(u8::from(corner == node))));
    let mut own = body.clone();
    let substeps = Spectrum::estimate(&mut own).substeps(1e-3);
    let law = Law { friction: 0.5.into(), ..Law::default() };
    let state = State::at_rest(body.rest());
    let stepping = Stepping { tick: 1e-3, substeps };
    let mut simulation = Simulation::new(Box::new(own), state, contact, law, stepping).unwrap();
    let tool = |n: u64| Vec3::from(path.at(HAPTIC.release(n).as_secs_f64()));

    let session =
        Session::builder(body).path(path.clone()).attach_node(node).friction(0.5).virtual_time().keep_records();
    let summary = run(session.model(LocalModelKind::Full), 0.4);
    let felt = forces(&summary);
    assert_eq!(felt.len(), 400);
    for (n, row) in (1..).zip(&felt) {
        let force = simulation.tick(ToolMotion::straight(tool(n - 1), tool(n))).force;
        assert_eq!(bits(row.force_n), bits(force.into()), "tick {n}");
    }
    assert!(felt.iter().any(|row| norm(row.force_n) > 0.1));
}

#[test]
fn a_global_release_takes_every_sample_up_to_its_own_time() {
    let summary = run(session(), 0.2);
    let ticks: Vec<_> = global_ticks(&summary).iter().map(|r| (r.time.0, r.first_tick, r.last_tick)).collect();
    assert_eq!(
        ticks,
        [
            (33_333_333, 1, 33),
            (66_666_666, 34, 66),
            (100_000_000, 67, 100),
            (133_333_333, 101, 133),
            (166_666_666, 134, 166),
            (200_000_000, 167, 200),
        ]
    );
}

/// The first tick that each version served.
fn first_ticks(forces: &[ForceSample]) -> Vec<(u32, u64)> {
    let mut firsts: Vec<(u32, u64)> = Vec::new();
    for force in forces {
        if firsts.last().is_none_or(|(version, _)| *version != force.model_version) {
            firsts.push((force.model_version, HAPTIC.last_release(force.time)));
        }
    }
    firsts
}

#[test]
fn a_result_in_time_serves_from_the_tick_after_its_release() {
    for model in [LocalModelKind::Hold, LocalModelKind::Patch] {
        let summary = run(session().model(model), 0.14);
        let served = first_ticks(&forces(&summary));
        // At equal times the global model comes last: what release 3 gives at 100 ms serves tick 101.
        assert_eq!(served, [(1, 1), (2, 34), (3, 67), (4, 101), (5, 134)], "{model:?}");
    }
}

/// Check that the first tick at or after release + latency sees a result, and that a patch serves once it has caught up.
#[test]
fn a_late_result_serves_once_it_is_visible_and_caught_up() {
    for latency_us in [1, 667, 668, 5_000, 16_667, 20_000, 33_340, 50_000, 66_700] {
        for (model, catches_up) in [(LocalModelKind::Hold, false), (LocalModelKind::Patch, true)] {
            let session = session().model(model).global(latency(latency_us)).feedback(Feedback::Trajectory);
            let served = first_ticks(&forces(&run(session, 0.3)));
            let visible = (33_333_333 + latency_us * 1000).div_ceil(1_000_000);
            let mut tick = visible;
            let mut reached = 33;
            // Eight ticks of the past per tick, while one more falls due.
            while catches_up && reached < tick - 1 {
                reached = (tick - 1).min(reached + 8);
                if reached < tick - 1 {
                    tick += 1;
                }
            }
            assert_eq!(served[..2], [(1, 1), (2, tick)], "{model:?} with {latency_us} us: {served:?}");
            assert!(served.windows(2).all(|pair| pair[1].0 == pair[0].0 + 1), "{served:?}");
        }
    }
}

#[test]
fn a_patch_that_was_late_gives_the_very_forces_of_one_that_was_in_time() {
    let with = |group| forces(&run(session().global(group).feedback(Feedback::Trajectory), 0.4));
    let (in_time, late) = (with(latency(0)), with(latency(16_667)));
    let mut compared = 0;
    for (a, b) in in_time.iter().zip(&late).filter(|(a, b)| a.model_version == b.model_version) {
        assert_eq!((a.time, bits(a.force_n)), (b.time, bits(b.force_n)));
        compared += u32::from(norm(a.force_n) > 0.05);
    }
    assert!(compared > 100, "{compared} ticks with a force were comparable");
    assert!(in_time.iter().zip(&late).any(|(a, b)| a.force_n != b.force_n), "late is not the same as in time");
}

#[test]
fn the_age_of_the_model_grows_with_its_latency() {
    let oldest = |us: u64| {
        let summary = run(session().global(latency(us)), 0.5);
        assert!(forces(&summary).iter().all(|r| r.force_n.iter().all(|c| c.is_finite())));
        forces(&summary).iter().map(|r| (r.model_age_s * 1e3).round() as u64).max().unwrap()
    };
    let [none, full, half_more, double] = [0, 33_340, 50_000, 66_700].map(oldest);
    assert_eq!(none, 34);
    assert!(
        full >= none + 33 && half_more >= full + 16 && double >= half_more + 16,
        "{none} {full} {half_more} {double}"
    );
}

/// `hold` has one force per version, so that the weights of the blend can be read off.
#[test]
fn a_crossfade_moves_linearly_from_the_old_force_to_the_new() {
    let hold = || session().model(LocalModelKind::Hold).feedback(Feedback::Trajectory);
    let (plain, faded) = (run(hold(), 0.3), run(hold().crossfade_ms(10.0), 0.3));
    let (switched, blended) = (forces(&plain), forces(&faded));
    let mut jumps = Vec::new();
    for (version, first) in first_ticks(&switched).into_iter().skip(1) {
        let at = first as usize - 1;
        let (old, new) = (Vec3::from(switched[at - 1].force_n), Vec3::from(switched[at].force_n));
        for k in 0..=10.min(switched.len() - 1 - at) {
            let expected = old + (new - old) * (k as f64 / 10.0);
            let force = Vec3::from(blended[at + k].force_n);
            assert!(
                (force - expected).norm() <= 1e-12 * (1.0 + old.norm() + new.norm()),
                "version {version}, tick {k}"
            );
            assert_eq!(blended[at + k].model_version, version);
        }
        jumps.push((new - old).norm());
    }
    assert!(jumps.len() >= 8 && jumps.iter().any(|jump| *jump > 0.05), "{jumps:?}");
    // The report of a resync says what was seen: the whole jump before, a tenth of it after.
    for (resync, jump) in resyncs(&faded).iter().zip(&jumps) {
        assert!((resync.jump_before_n - jump).abs() <= 1e-12);
        assert!((resync.jump_after_n - jump / 10.0).abs() <= 1e-12);
    }
    for (resync, jump) in resyncs(&plain).iter().zip(&jumps) {
        assert_eq!((resync.jump_before_n, resync.jump_after_n), (*jump, *jump));
    }
}

#[test]
fn other_rates_keep_the_convention() {
    let peak = |forces: &[ForceSample]| forces.iter().map(|f| norm(f.force_n)).fold(0.0, f64::max);
    let usual = peak(&forces(&run(session().model(LocalModelKind::Full), 0.3)));
    for haptic in [500, 2000, 4000] {
        for global in [Rate::hz(10), Rate::new(2997, 100), Rate::hz(60)] {
            let haptic = Rate::hz(haptic);
            let (local, slow) = (RateGroup::new(haptic), RateGroup::new(global));
            let summary = run(session().local(local.clone()).global(slow.clone()), 0.3);
            let name = format!("{haptic} over {global}");
            let felt = forces(&summary);
            assert_eq!(felt.len() as u64, haptic.last_release(Nanos(300_000_000)), "{name}");
            for (n, force) in (1..).zip(&felt) {
                assert_eq!(force.time, haptic.release(n), "{name}");
                assert!(norm(force.force_n).is_finite(), "{name}");
            }
            let mut next = 1;
            for (k, tick) in (1..).zip(global_ticks(&summary)) {
                assert_eq!((tick.time, tick.first_tick), (global.release(k), next), "{name}");
                assert_eq!(tick.last_tick, haptic.last_release(tick.time), "{name}");
                next = tick.last_tick + 1;
            }
            assert!(resyncs(&summary).len() >= 2, "{name}");
        }
        // The same physics, whatever the tick.
        let local = RateGroup::hz(haptic);
        let full = peak(&forces(&run(session().model(LocalModelKind::Full).local(local), 0.3)));
        assert!((full / usual - 1.0).abs() < 0.05, "{haptic} Hz: {full} N instead of {usual} N");
    }
}

#[test]
fn a_group_that_would_break_the_convention_is_refused() {
    let haptic = || RateGroup::new(HAPTIC);
    let late = Nanos(5_000_000);
    for (session, words) in [
        (session().local(haptic().offset(late)), "local: has an offset"),
        (session().local(haptic().latency(late)), "local: has a latency"),
        (session().local(haptic().observer()), "local: is an observer"),
        (session().global(RateGroup::hz(30).offset(late)), "global: has an offset"),
        (session().global(RateGroup::hz(30).observer()), "global: is an observer"),
        (session().local(haptic().overrun(OverrunPolicy::Rephase)), "local: has the policy Rephase"),
        (session().local(haptic().overrun(OverrunPolicy::CatchUp { max: 51 })), "local: catches up after stops"),
        (session().global(RateGroup::hz(30).device_paced(Nanos(50_000_000))), "global: is paced by a device"),
    ] {
        let error = session.build().unwrap_err();
        assert_eq!(error.kind(), palpate::ErrorKind::Runtime);
        assert!(error.to_string().starts_with(words), "{error}");
    }
    session().local(haptic().pin(0).realtime(50)).global(latency(5_000)).build().unwrap();
    session().local(haptic().device_paced(late)).build().unwrap();
    session().local(haptic().overrun(OverrunPolicy::CatchUp { max: 50 })).build().unwrap();
    session().global(latency(0).overrun(OverrunPolicy::Rephase)).build().unwrap();
}

/// Says that it exerts this force at most.
#[derive(Debug)]
struct Claims(f64);

impl Device for Claims {
    fn name(&self) -> &str {
        "claims"
    }

    fn capabilities(&self) -> Capabilities {
        Capabilities { max_force_n: self.0, ..Capabilities::default() }
    }

    fn read(&mut self, _: Nanos) -> Result<DeviceState, DeviceFault> {
        Ok(DeviceState::default())
    }

    fn write(&mut self, _: palpate::devices::ForceCommand) -> Result<(), DeviceFault> {
        Ok(())
    }
}

#[test]
fn a_device_whose_largest_force_is_no_positive_number_is_refused() {
    for force_n in [-4.0, 0.0, f64::NAN, f64::INFINITY] {
        let error = session().device(Claims(force_n)).build().unwrap_err().to_string();
        assert_eq!(error, format!("device: has a largest force of {force_n} N, must be a finite number above 0"));
    }
}

#[test]
fn the_first_local_model_is_built_around_the_tool() {
    let top = block().lattice().id([3, 3, 5]);
    let summary = run(session().probe(top), 0.033);
    // No resync has come yet: a patch elsewhere would feel nothing and let the probed node lie.
    assert!(resyncs(&summary).is_empty());
    let felt = forces(&summary);
    assert!(norm(felt[32].force_n) > 0.05, "{:?}", felt[32]);
    let moved = summary
        .records
        .iter()
        .any(|record| matches!(record, LogRecord::Probe(probe) if probe.node == top && probe.local_m[2] < 0.1 - 1e-4));
    assert!(moved);
}

#[test]
fn a_run_can_be_taken_in_steps_and_ended_early() {
    let whole = run(session(), 0.2);
    let running = session().duration_s(10.0).build().unwrap().start().unwrap();
    for _ in 0..4 {
        running.wait_for(std::time::Duration::from_millis(50));
    }
    assert!(!running.finished());
    assert_eq!(running.elapsed(), Nanos(200_000_000));
    let steps = running.stop();
    assert_eq!(forces(&steps), forces(&whole));
}

#[test]
fn a_renderer_sees_the_newest_surface_tool_and_force() {
    let mut running = session().duration_s(0.2).build().unwrap().start().unwrap();
    let mut viewer = running.take_viewer().unwrap();
    assert!(running.take_viewer().is_none(), "there is one viewer");
    let body = block();
    assert_eq!(*viewer.triangles(), *body.surface().triangles);
    assert_eq!(viewer.surface().positions, body.rest());
    running.wait_for(std::time::Duration::from_millis(150));
    assert_eq!(viewer.surface().time, Nanos(133_000_000));
    assert_ne!(viewer.surface().positions, body.rest());
    let tool = viewer.tool();
    running.wait();
    let summary = running.stop();
    let row = forces(&summary).into_iter().find(|row| row.time == tool.time).unwrap();
    assert_eq!((tool.time, <[f64; 3]>::from(tool.computed_force)), (Nanos(150_000_000), row.force_n));
}

/// A block that bears steps of half a millisecond, at a haptic rate, with steps of the whole body of so many haptic ticks.
fn in_strides(rate_hz: u32, ticks: u32) -> Result<Scene, Error> {
    let text = format!(
        "[body.block]\nnodes = [8, 8, 8]\nsize_m = [0.1, 0.1, 0.1]\n[body.material]\nnode_mass_kg = 0.0005\n\
         stiffness_n_per_m = 30.0\ndamping_ratio = 0.3\n[contact]\nfriction = 0.5\n[local]\nrate_hz = {rate_hz}\n\
         [global]\nticks_per_step = {ticks}\n[device]\ntool = {{ shape = \"sphere\", radius_m = 0.008 }}\n\
         path_csv = \"scenes/paths/drag.csv\"\n[run]\nduration_s = 0.6\n"
    );
    let mut scene = Scene::from_toml(&text, "scene.toml", None)?;
    let corners = vec![[0.04, 0.05, 0.109], [0.04, 0.05, 0.102], [0.06, 0.05, 0.102]];
    scene.devices[0].path = Some(ToolPath::new(vec![0.0, 0.2, 0.6], corners).unwrap());
    Ok(scene)
}

/// Check that a whole body whose steps are longer than a haptic tick serves a local model as well as one that follows each tick.
#[test]
fn a_global_model_may_take_steps_of_several_ticks() {
    let forces = |ticks: u32, model: LocalModelKind| -> Vec<Vec3> {
        let session = Session::from_scene(in_strides(4000, ticks).unwrap()).model(model).virtual_time().keep_records();
        force_vectors(&session.build().unwrap().run().unwrap())
    };
    let full = forces(2, LocalModelKind::Full);
    assert_eq!(full, forces(1, LocalModelKind::Full), "full is simulated at the haptic rate");
    let [short, long] = [1, 2].map(|ticks| rms_percent(&forces(ticks, LocalModelKind::Predictive), &full));
    println!("{short:.3} % in steps of a tick, {long:.3} % in steps of two");
    assert!(short < 0.5 && long < 0.5 && short != long, "{short} {long}");
}

#[test]
fn a_step_that_spans_more_ticks_than_are_stable_is_refused() {
    let error = |rate_hz: u32, ticks: u32| {
        let session = in_strides(rate_hz, ticks).and_then(|scene| Session::from_scene(scene).virtual_time().build());
        session.err().map(|error| error.to_string())
    };
    assert_eq!((error(4000, 1), error(4000, 2)), (None, None));
    for (rate, ticks, words) in [(4000, 3, "must be 1 to 2"), (1000, 2, "must be 1 to 1"), (4000, 0, "at least 1")] {
        let error = error(rate, ticks).expect("it is refused");
        assert!(error.contains("global.ticks_per_step") && error.contains(words), "{error}");
    }
}
