"""Files of a run: run folders, exports, and how they are read and audited."""

from tpbso_casadi.plain import BrokenSeal, check_seal, sealed
from tpbso_casadi.storage.certificate import check_certificate, check_certificate_file, write_certificate
from tpbso_casadi.storage.files import (
    OutputError,
    check_file,
    check_writable,
    replacing,
    write_csv,
    write_text,
    write_with,
    writing,
)
from tpbso_casadi.storage.motion_tables import table_of, write_motion
from tpbso_casadi.storage.recomputation import Contradiction
from tpbso_casadi.storage.result import InvalidResult, RunResult, StoredRun, result_of, stored
from tpbso_casadi.storage.run_folder import (
    LARGEST_RESULT,
    OtherPlan,
    Writer,
    add_to_plan,
    check_run_folder,
    replace_folder,
    stored_content,
    write_plan,
)
from tpbso_casadi.storage.stored_run import InvalidRun, checked, path_table, read_earlier, read_result, read_run
from tpbso_casadi.storage.tables import (
    CertificateResult,
    ConstraintResult,
    Count,
    FileName,
    HistoryResult,
    Number,
    PiecesResult,
    Seconds,
)

__all__ = [
    "LARGEST_RESULT",
    "BrokenSeal",
    "CertificateResult",
    "ConstraintResult",
    "Contradiction",
    "Count",
    "FileName",
    "HistoryResult",
    "InvalidResult",
    "InvalidRun",
    "Number",
    "OtherPlan",
    "OutputError",
    "PiecesResult",
    "RunResult",
    "Seconds",
    "StoredRun",
    "Writer",
    "add_to_plan",
    "check_certificate",
    "check_certificate_file",
    "check_file",
    "check_run_folder",
    "check_seal",
    "check_writable",
    "checked",
    "path_table",
    "read_earlier",
    "read_result",
    "read_run",
    "replace_folder",
    "replacing",
    "result_of",
    "sealed",
    "stored",
    "stored_content",
    "table_of",
    "write_certificate",
    "write_csv",
    "write_motion",
    "write_plan",
    "write_text",
    "write_with",
    "writing",
]
