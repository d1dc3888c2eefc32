"""What only the nightly run has, so that nothing slips into it unseen: longer forms of tests that
every run has."""

import pytest

from tests.support.nightly import COLLECTED
from tests.support.places import ROOT

#: the functions with a longer form, by their files
NIGHTLY = {
    "builder/export/test_c_header.py": {
        "test_every_level_gives_the_librarys_bits",
        "test_no_compiler_warns",
    },
    "builder/tables/test_seams.py": {"test_a_table_of_an_odd_tolerance_keeps_its_bounds"},
    "builder/tables/test_verify.py": {
        "test_a_block_off_by_a_hundred_thousandth_is_found_and_named"
    },
    "mumacro/fits/test_fitting.py": {"test_inputs_lie_within_their_covariance"},
    "mumacro/fits/test_loop.py": {"test_intervals_of_noisy_loops_hold_the_truth"},
    "mumacro/kernel/test_kernel_safety.py": {"test_sanitizers_are_silent"},
    "mumacro/kernel/test_processors.py": {
        "test_a_table_that_is_built_there_differs_within_what_both_state",
        "test_what_a_table_states_is_measured_there_too",
    },
    "mumacro/table/test_committed_tables.py": {"test_fresh_solves_lie_within_tolerance_and_bounds"},
    "service/test_service_fuzz.py": {"test_an_attack_takes_little_memory_and_keeps_nobody_waiting"},
}


def test_the_nightly_tests_are_those_listed_and_each_has_a_form_that_every_run_has(
    pytestconfig: pytest.Config,
) -> None:
    ordinary, nightly = (pytestconfig.stash[COLLECTED][marked] for marked in (False, True))
    files = {file for file, _ in ordinary}
    listed = {(file, function) for file, of_it in NIGHTLY.items() for function in of_it}
    assert nightly == {one for one in listed if one[0] in files}
    assert nightly <= ordinary
    assert all((ROOT / "tests" / file).is_file() for file in NIGHTLY)
