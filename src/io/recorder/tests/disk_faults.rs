//! A disk that is full, slow or stands still.

use super::*;

#[test]
fn a_full_disk_ends_the_recording_and_leaves_a_beginning_that_reads_back() {
    let disk = Disk::with_room(6000);
    let (mut recorder, alarms) = start_with(&config(), disk.clone(), quick()).unwrap();
    let mut taken = 0;
    let why = loop {
        match recorder.record(Stamp::from_ns(taken), &event(taken), &Step::default()) {
            Ok(()) => taken += 1,
            Err(why) => break why,
        }
        disk.wait_for_a_write();
    };
    assert!(why.0.contains("disk.mcap") && why.0.contains("full"), "{why}");
    assert_eq!(alarms.recv().unwrap(), why);
    recorder.record(Stamp::from_ns(taken), &event(taken), &Step::default()).unwrap_err();
    let incomplete = recorder.finish().unwrap_err();
    assert_eq!(incomplete.why, why);
    assert!(!disk.published());

    let mut recording = read(disk.bytes());
    let numbers = event_numbers(&mut recording);
    assert_eq!(numbers, (0..incomplete.report.events).collect::<Vec<_>>());
    assert!(!numbers.is_empty() && numbers.len() as u64 <= taken);
    assert_eq!(recording.integrity().lost_bytes, 0, "the file ends with a whole record");
}

#[test]
fn the_report_counts_what_full_chunks_hold() {
    let disk = Disk::with_room(700_000);
    let tuning =
        RecorderLimits { flush_every: Duration::from_secs(3600), ..RecorderLimits::default() };
    let (mut recorder, alarms) = start_with(&config(), disk.clone(), tuning).unwrap();
    let mut noise = 1_u64;
    let mut text = || {
        noise = noise.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        format!("{noise:016x}")
    };
    for n in 0..1500 {
        let reason = (0..128).map(|_| text()).collect();
        let event = Event::LinkDown { reason };
        if recorder.record(Stamp::from_ns(n), &event, &Step::default()).is_err() {
            break;
        }
    }
    alarms.recv().unwrap();
    let report = recorder.finish().unwrap_err().report;
    let numbers = event_numbers(&mut read(disk.bytes()));
    assert!(report.events > 100);
    assert_eq!(numbers, (0..report.events).collect::<Vec<_>>());
}

#[test]
fn a_disk_that_recovers_gets_what_was_taken_and_a_proper_end() {
    let disk = Disk::with_room(3000);
    let (mut recorder, alarms) = start_with(&config(), disk.clone(), quick()).unwrap();
    let mut taken = 0;
    while recorder.record(Stamp::from_ns(taken), &event(taken), &Step::default()).is_ok() {
        taken += 1;
        disk.wait_for_a_write();
    }
    alarms.recv().unwrap();
    disk.make_room();
    let incomplete = recorder.finish().unwrap_err();
    assert_eq!(incomplete.report.events, taken);
    assert!(!disk.published(), "the end of the run is still missing");
    let mut recording = read(disk.bytes());
    assert_eq!(event_numbers(&mut recording).len() as u64, taken);
    assert_eq!(recording.integrity().summary(), None);
}

#[test]
fn a_slow_disk_costs_frames_but_no_event() {
    let disk = Disk::default();
    let (mut recorder, _alarms) = start_with(&config(), disk.clone(), quick()).unwrap();
    disk.stall();
    for n in 0..500 {
        recorder.record(Stamp::from_ns(n), &event(n), &Step::default()).unwrap();
        recorder.frames().frame(frame(n));
    }
    let dropped = recorder.frames_dropped();
    disk.go_on();
    let report = recorder.finish().unwrap();
    assert!(dropped > 0);
    assert_eq!((report.events, report.steps), (500, 500));
    assert_eq!(report.frames_kept + report.frames_dropped, 500);
    assert_eq!(event_numbers(&mut read(disk.bytes())), (0..500).collect::<Vec<_>>());
}

#[test]
fn a_disk_that_stands_still_ends_control_and_loses_nothing_that_was_taken() {
    let disk = Disk::default();
    let tuning = RecorderLimits { events: 16, ..quick() };
    let (mut recorder, alarms) = start_with(&config(), disk.clone(), tuning).unwrap();
    disk.stall();
    let mut taken = 0;
    while recorder.record(Stamp::from_ns(taken), &event(taken), &Step::default()).is_ok() {
        taken += 1;
        if taken == 16 {
            disk.wait_until_stalled();
        }
    }
    assert!(alarms.recv().unwrap().0.contains("does not keep up"));
    disk.go_on();
    let incomplete = recorder.finish().unwrap_err();
    assert_eq!(incomplete.report.events, taken);
    assert_eq!(event_numbers(&mut read(disk.bytes())), (0..taken).collect::<Vec<_>>());
}

#[test]
fn what_is_taken_reaches_the_disk_without_further_events() {
    let disk = Disk::default();
    let (mut recorder, _alarms) = start_with(&config(), disk.clone(), quick()).unwrap();
    disk.forget_writes();
    recorder.record(Stamp::START, &event(0), &Step::default()).unwrap();
    disk.wait_for_a_write();
    let so_far = disk.bytes();
    assert_eq!(event_numbers(&mut read(so_far)), [0]);
}

#[test]
fn the_flush_period_is_within_half_a_second() {
    assert!(RecorderLimits::default().flush_every < Duration::from_millis(500));
}
