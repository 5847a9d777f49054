//! The global model behind a link: the same forces where the link does nothing, safe ones whatever it does, and the same in every run.

mod session_support;

use std::time::Duration;

use palpate::log::{ForceSample, ServedBy};
use palpate::model::Vec3;
use palpate::model::body::{Block, Body};
use palpate::model::local::{Feedback, Kind};
use palpate::runtime::{Nanos, RateGroup};
use palpate::scene::{LinkSpec, Scene};
use palpate::session::{Session, SessionBuilder, Summary};
use session_support::*;

fn session(model: Kind) -> SessionBuilder {
    session_of(block(), model)
}

fn session_of(body: Block, model: Kind) -> SessionBuilder {
    Session::builder(body).path(pressing()).model(model).friction(0.5).virtual_time().keep_records()
}

fn run(builder: SessionBuilder, seconds: f64) -> Summary {
    let summary = builder.duration_s(seconds).build().unwrap().run().unwrap();
    assert_eq!((&summary.runtime.fault, summary.runtime.lost_records), (&None, 0));
    summary
}

fn delayed(delay_ms: f64) -> LinkSpec {
    LinkSpec { delay_ms, ..LinkSpec::default() }
}

/// What a bad network does.
fn bad() -> LinkSpec {
    LinkSpec {
        delay_ms: 14.0,
        jitter_ms: 6.0,
        loss: 0.05,
        duplicate: 0.05,
        reorder: 0.05,
        rate_mbit_s: Some(100.0),
        seed: 7,
        ..LinkSpec::default()
    }
}

/// The rms difference of two series of forces, in % of the peak of the second.
fn error_pct(forces: &[ForceSample], truth: &[ForceSample]) -> f64 {
    let peak = truth.iter().map(|f| norm(f.force_n)).fold(0.0, f64::max);
    let squares = forces.iter().zip(truth).map(|(a, b)| (Vec3::from(a.force_n) - Vec3::from(b.force_n)).norm_squared());
    100.0 * (squares.sum::<f64>() / truth.len() as f64).sqrt() / peak
}

/// At 31 Hz no global release coincides with a haptic one, so that what the bridges add is one tick: results that are 1 ms late.
#[test]
fn a_link_that_does_nothing_changes_nothing() {
    for model in Kind::ALL.into_iter().filter(|&kind| kind != Kind::Full) {
        let has_ring = matches!(model, Kind::Predicted | Kind::Predictive);
        let session = || session_of(if has_ring { wide_block() } else { block() }, model);
        let late = session().feedback(Feedback::Trajectory).global(RateGroup::hz(31).latency(Nanos(1_000_000)));
        let linked = session().global(RateGroup::hz(31)).link(delayed(0.0));
        let (late, linked) = (forces(&run(late, 0.9)), forces(&run(linked, 0.9)));
        assert!(late.iter().any(|force| norm(force.force_n) > 0.2));
        let served = |forces: &[ForceSample]| -> Vec<_> {
            forces.iter().map(|f| (f.model_version, f.served_by, f.model_age_s.to_bits())).collect()
        };
        assert_eq!(served(&linked), served(&late), "{model:?}");
        if has_ring {
            // The ring's path is rounded.
            let apart = error_pct(&linked, &late);
            assert!(apart > 0.0 && apart < 1e-3, "{model:?}: {apart} %");
        } else {
            assert!(late.iter().zip(&linked).all(|(a, b)| bits(a.force_n) == bits(b.force_n)), "{model:?}");
        }
    }
}

#[test]
fn chance_is_the_same_in_every_run_and_another_with_another_seed() {
    for model in [Kind::Hold, Kind::Patch, Kind::Predictive] {
        let felt = |seed| -> Vec<_> {
            let summary = run(session(model).link(LinkSpec { seed, ..bad() }), 0.8);
            forces(&summary).iter().map(|force| bits(force.force_n)).collect()
        };
        assert_eq!(felt(7), felt(7), "{model:?}");
        assert_ne!(felt(7), felt(8), "{model:?}");
    }
}

#[test]
fn the_age_of_a_model_counts_both_ways() {
    let oldest = |link| {
        let summary = run(session(Kind::Hold).link(link), 0.6);
        let ages =
            forces(&summary).iter().skip(300).map(|force| (force.model_age_s * 1e3).round() as u64).collect::<Vec<_>>();
        *ages.iter().max().unwrap()
    };
    let [none, some, more] = [0.0, 14.0, 40.0].map(|delay_ms| oldest(delayed(delay_ms)));
    assert!((34..=36).contains(&none), "{none}");
    assert!(some.abs_diff(none + 28) <= 1 && more.abs_diff(none + 80) <= 1, "{none} {some} {more}");
}

#[test]
fn predictive_keeps_its_force_over_a_bad_link_where_the_others_lose_it() {
    let session = |model| session_of(wide_block(), model);
    let truth = forces(&run(session(Kind::Full), 1.5));
    let of = |model| error_pct(&forces(&run(session(model).link(bad()), 1.5)), &truth);
    let [hold, patch, predictive] = [Kind::Hold, Kind::Patch, Kind::Predictive].map(of);
    println!("hold {hold:.2} %, patch {patch:.2} %, predictive {predictive:.3} %");
    assert!(predictive < 2.0 && hold > 5.0 * predictive && patch > 5.0 * predictive, "{hold} {patch} {predictive}");
}

/// A basis is larger than the models that need it, and where packets are lost it comes later than they do.
#[test]
fn no_model_comes_without_the_basis_that_it_was_made_for() {
    let across = |t: f64| [0.065 + 0.04 * (3.0 * t).sin(), 0.065 + 0.03 * (2.0 * t).sin(), 0.019];
    let session = || {
        let session = Session::builder(sheet()).path(sampled(across)).model(Kind::Predictive);
        session.virtual_time().keep_records()
    };
    let without = |summary: &Summary| {
        let served = forces(summary);
        served.iter().filter(|force| force.served_by == ServedBy::Predicted).count()
    };
    let link = LinkSpec { delay_ms: 14.0, loss: 0.03, seed: 3, ..LinkSpec::default() };
    let [here, linked] = [run(session(), 1.5), run(session().link(link), 1.5)].map(|summary| without(&summary));
    assert_eq!([here, linked], [0, 0]);
}

/// Check that the force fades with the age of the model, is gone when that is too old, and comes back with the link: in a new
/// epoch, slowly.
#[test]
fn a_link_that_breaks_takes_the_force_away_and_gives_it_back() {
    for model in [Kind::Hold, Kind::Patch, Kind::Predictive] {
        let link = LinkSpec { down_s: vec![[0.5, 1.5], [2.2, 2.3]], ..delayed(5.0) };
        let whole = commands(&run(session(model).link(delayed(5.0)), 3.0));
        let summary = run(session(model).link(link), 3.0);
        let commands = commands(&summary);
        let at = |ms: usize| norm(commands[ms - 1].force_n);
        let felt = |ms: usize| norm(whole[ms - 1].force_n);
        assert!(felt(450) > 0.1 && at(450) == felt(450));
        // The newest model is at most 45 ms old at 500 ms, so the force has gone 300 ms after that state.
        assert!((820..1500).all(|ms| at(ms) == 0.0), "{model:?}");
        // Back within a second of the link's return, and slowly: k ticks after the first, k/200 of what is computed at most.
        assert!((1_500..2_200).any(|ms| at(ms) > 0.5 * felt(ms)), "{model:?}");
        let first = (1_500..).find(|&ms| at(ms) > 0.0).unwrap();
        let computed = forces(&summary);
        for ms in first..first + 200 {
            let most = (ms - first + 1) as f64 / 200.0 * norm(computed[ms - 1].force_n);
            assert!(at(ms) <= most + 0.01, "{model:?}: {} N {} ms after the first, of {most}", at(ms), ms - first);
        }
        // An outage that is shorter than the limit is hardly felt.
        assert!((2_200..2_600).all(|ms| at(ms) > 0.0 || felt(ms) < 0.02), "{model:?}");
        let global = global_ticks(&summary);
        assert!(global.iter().any(|tick| tick.time > Nanos(1_500_000_000)));
    }
}

#[test]
fn a_second_of_delay_is_no_force_and_no_energy() {
    for model in [Kind::Hold, Kind::Predictive] {
        let summary = run(session(model).link(delayed(1_000.0)), 3.5);
        let commands = commands(&summary);
        assert!(commands.iter().all(|command| command.force_n.iter().all(|component| component.is_finite())));
        // The first model is of the start, and there is no other for two seconds.
        assert!(commands.iter().skip(300).all(|command| norm(command.force_n) == 0.0), "{model:?}");
        let last = commands.last().unwrap();
        assert!(last.energy_j >= -1e-9, "{model:?}: {} J came out", -last.energy_j);
        assert!(forces(&summary).iter().all(|force| force.force_n.iter().all(|component| component.is_finite())));
    }
}

#[test]
fn a_session_over_a_link_is_replayed_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let scene = || Session::from_scene(Scene::demo()).model(Kind::Predictive).link(bad());
    for (name, builder) in [("virtual", scene().virtual_time()), ("threads", scene())] {
        let log = folder.path().join(name);
        let mut running = builder.duration_s(1.0).log(&log).build().unwrap().start().unwrap();
        running.wait_for(Duration::from_millis(500));
        running.take_controls().unwrap().set_friction(0.1.into()).unwrap();
        running.wait();
        let summary = running.stop();
        assert!(summary.log_error.is_none() && summary.report.devices[0].force.ticks > 500);
        let report = Session::replay(&log).unwrap().run().unwrap();
        assert!(report.is_identical() && report.force.logged > 500, "{name}: {report}");
    }
}

#[test]
fn two_tools_share_a_link() {
    let away = palpate::devices::ToolPath::constant([0.08, 0.03, 0.097]).unwrap();
    let session = |linked: bool| {
        let first = palpate::devices::Scripted::new(pressing());
        let second = palpate::devices::Scripted::new(away.clone());
        let session = Session::builder(wide_block()).named_device("left", first).named_device("right", second);
        let session = session.model(Kind::Predictive).friction(0.5).virtual_time().keep_records();
        let session = session.feedback(Feedback::Trajectory);
        match linked {
            true => session.global(RateGroup::hz(31)).link(delayed(0.0)),
            false => session.global(RateGroup::hz(31).latency(Nanos(1_000_000))),
        }
    };
    let [here, there] = [false, true].map(|linked| forces(&run(session(linked), 0.5)));
    for device in [0, 1] {
        let of = |forces: &[ForceSample]| forces.iter().copied().filter(|f| f.device == device).collect::<Vec<_>>();
        let (here, there) = (of(&here), of(&there));
        assert!(here.len() == 500 && here.iter().any(|force| norm(force.force_n) > 0.05));
        assert!(error_pct(&there, &here) < 1e-3, "{device}: {} %", error_pct(&there, &here));
    }
}

#[test]
fn a_link_that_cannot_be_is_refused_by_name() {
    let wrong = |change: fn(&mut Scene), place: &str| {
        let mut scene = Scene::demo();
        scene.link = Some(bad());
        change(&mut scene);
        let error = scene.validate().unwrap_err();
        assert_eq!(error.place(), place, "{error}");
    };
    wrong(|scene| scene.link.as_mut().unwrap().delay_ms = -1.0, "link.delay_ms");
    wrong(|scene| scene.link.as_mut().unwrap().jitter_ms = f64::NAN, "link.jitter_ms");
    wrong(|scene| scene.link.as_mut().unwrap().loss = 1.0, "link.loss");
    wrong(|scene| scene.link.as_mut().unwrap().rate_mbit_s = Some(0.0), "link.rate_mbit_s");
    wrong(|scene| scene.link.as_mut().unwrap().down_s = vec![[1.0, 1.0]], "link.down_s");
    wrong(
        |scene| {
            *scene = scene.clone().with_model(Kind::Patch);
            scene.local.feedback = Some(Feedback::Geometry);
        },
        "local.feedback",
    );
    let own = AlteredBlock::new(block(), |block, state, forces| block.forces(state, forces));
    let error = Session::builder(own).model(Kind::Hold).link(bad()).build().map(|_| ()).unwrap_err();
    assert_eq!(error.place(), "link", "{error}");
}
