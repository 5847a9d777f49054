//! The vendor's public client, the crate `haply`, against palpate's mock service: inventory, forces, probes, events.

use std::time::Duration;

use haply::HaplyDevice;
use haply::device_model::{ControlMode, Force, ForceInput, ProfileConfig, SessionConfigure};
use haply::events::EventChannel;
use palpate_haply::mock::{MockFaultKind, MockOptions, MockService};
use tokio::time::sleep;

type Failure = Box<dyn std::error::Error + Send + Sync>;

fn push(newtons: f32) -> Vec<ForceInput> {
    vec![ForceInput { device_id: "049D".to_owned(), forces: Force { x: 0.0, y: newtons, z: 0.0 } }]
}

#[tokio::main]
async fn main() -> Result<(), Failure> {
    let mock = MockService::start(MockOptions { port: 0, events_port: 0, ..MockOptions::default() })?;
    let address = format!("ws://{}/", mock.address());
    let mut device = HaplyDevice::new(&format!("http://{}", mock.address()), &address).await?;
    let events = EventChannel::new(&format!("ws://{}/", mock.events_address())).await?;
    sleep(Duration::from_millis(200)).await;

    // The inventory comes without being asked for, with the configuration.
    let state = device.read_state().await?;
    let inverse = state.inverse3.first().ok_or("no Inverse3 in the inventory")?;
    assert_eq!(inverse.device_id, "049D");
    let config = inverse.config.as_ref().ok_or("the inventory has no configuration")?;
    println!(
        "inventory    device {}, {:?}, firmware {}.{}",
        inverse.device_id, config.type_, config.device_info.major_version, config.device_info.minor_version
    );
    assert!(inverse.status.ready && inverse.status.calibrated);
    let at_rest = inverse.state.cursor_position.ok_or("no cursor")?;

    // A session with a profile, then a force for half a second.
    let profile = Some(ProfileConfig { name: "co.example:interop".to_owned(), required_version: None });
    device.configure_session(SessionConfigure { profile, ..SessionConfigure::default() }, Some(true)).await?;
    for _ in 0..500 {
        device.update_force(push(2.0), None, Some(true)).await?;
        sleep(Duration::from_millis(1)).await;
    }
    sleep(Duration::from_millis(5)).await;
    let state = device.read_state().await?;
    let inverse = &state.inverse3[0];
    let moved = inverse.state.cursor_position.ok_or("no cursor")?.y - at_rest.y;
    println!(
        "force        2 N for 0.5 s moved the cursor by {:.1} mm, control mode {:?}",
        1e3 * moved,
        inverse.state.control_mode
    );
    // 2 N against the hand's 300 N/m
    assert!((0.004..0.009).contains(&moved), "{moved}");
    assert_eq!(inverse.state.control_mode, Some(ControlMode::Force));
    assert!(inverse.state.current_cursor_force.is_some_and(|force| (force.y - 2.0).abs() < 1e-6));

    // Commands stop: the device goes idle. A probe only looks; this client keeps its last force until it is cleared.
    device.clear_inverse3_commands("049D", haply::device_model::Inverse3CommandClear::all()).await?;
    sleep(Duration::from_millis(50)).await;
    device.probe_cursor_position(vec!["049D".to_owned()], Some(true)).await?;
    sleep(Duration::from_millis(50)).await;
    let idle = device.read_state().await?.inverse3[0].state.control_mode.clone();
    println!("probe        after a pause without commands: control mode {idle:?}");
    assert_eq!(idle, Some(ControlMode::Idle));

    // Events that this client knows come through; a safety event, which version 1.3.1 does not know, must not stop it.
    mock.fail(MockFaultKind::Ebrake);
    device.update_force(push(0.0), None, Some(true)).await?;
    sleep(Duration::from_millis(800)).await;
    mock.fail(MockFaultKind::Unplug);
    device.update_force(push(0.0), None, Some(true)).await?;
    sleep(Duration::from_millis(800)).await;
    let names: Vec<&str> = events.read_events().await.iter().map(|event| event.event.name()).collect();
    println!("events       {names:?}");
    assert_eq!(names, ["device-disconnected", "device-connected"]);

    let seen = mock.counts();
    println!("the mock saw {seen:?}");
    assert_eq!((seen.malformed, seen.conflicts, seen.connections), (0, 0, 1));
    assert_eq!(seen.replies, seen.messages, "one state for each message");
    device.shutdown().await?;
    println!("the public client works with the mock");
    Ok(())
}
