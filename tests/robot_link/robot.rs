//! What the simulated robot does, spoken to by hand.

use truebead::core::{Mm, RobotMode};

use crate::support::{Talk, listener, sim, sim_on};

fn t_ms(state: &str) -> u64 {
    state.split(' ').nth(1).unwrap().parse().unwrap()
}

#[test]
fn a_conversation_by_hand() {
    let sim = sim();
    let mut pc = Talk::call(sim.local_addr());
    pc.say("HELLO 1 me\r\n");
    assert_eq!(pc.hear().as_deref(), Some("HELLO 1 truebead-sim 60 150 60"));
    let state = pc.hear_one("STATE");
    let now = t_ms(&state);
    pc.say(&format!("SPEED 1 100.5 1000 {now}\nSPEED 2 200 1000 {now}\nSPEED 9 100 1000 {now}\n"));
    let text = "200 mm/s is not within 60 mm/s to 150 mm/s";
    assert_eq!(pc.hear_one("ERR"), format!("ERR 2 RANGE {text}"));
    assert_eq!(pc.hear_one("ERR"), "ERR 9 SEQUENCE expected 3");
    pc.say(&format!("SPEED 10 100 100 {}\n", now - 101));
    assert!(pc.hear_one("ERR").starts_with("ERR 10 STALE"));
    pc.say("STOP 11\nSPEED 12 100 1000 0\n");
    assert!(pc.hear_one("ERR").starts_with("ERR 12 MODE"));
    assert!(pc.hear_one("STATE").contains(" 11 STOP "));
    pc.say("BYE\n");
    pc.hear_the_end();
}

#[test]
fn three_bad_lines_in_a_row_are_refused_and_end_the_connection() {
    let sim = sim();
    let mut pc = Talk::call(sim.local_addr());
    pc.say("HELLO 1 me\nrubbish\nSPEED\nSTOP 1\nGET / HTTP/1.1\nHost: robot\n\n");
    for _ in 0..5 {
        assert!(pc.hear_one("ERR").starts_with("ERR 0 FORM"));
    }
    pc.hear_the_end();
}

#[test]
fn a_second_pc_replaces_the_first_and_counts_from_one() {
    let sim = sim();
    let mut first = Talk::call(sim.local_addr());
    first.say("HELLO 1 first\n");
    let now = t_ms(&first.hear_one("STATE"));
    first.say(&format!("SPEED 1 100 1000 {now}\n"));
    let mut second = Talk::call(sim.local_addr());
    second.say("HELLO 1 second\n");
    first.hear_the_end();
    let state = second.hear_one("STATE");
    assert_eq!(state.split(' ').nth(2), Some("0"), "{state}");
    second.say("STOP 1\n");
    while second.hear_one("STATE").split(' ').nth(2) != Some("1") {}
}

#[test]
fn without_hello_no_setpoint_is_taken() {
    let sim = sim_on(listener(), 0);
    sim.begin_bead(Mm::ZERO);
    let mut pc = Talk::call(sim.local_addr());
    pc.say("SPEED 1 100 1000 0\n");
    assert_eq!(pc.hear().as_deref(), Some("ERR 1 FORM HELLO must come first"));
}

#[test]
fn a_fault_is_left_only_at_the_robot() {
    let sim = sim();
    let mut pc = Talk::call(sim.local_addr());
    pc.say("HELLO 1 me\n");
    while !pc.hear_one("STATE").contains(" PRINT ") {}
    sim.fail();
    while !pc.hear_one("STATE").contains(" FAULT ") {}
    sim.acknowledge();
    assert_eq!(sim.mode(), RobotMode::Idle);
}
