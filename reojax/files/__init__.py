"""Results as files: written whole or not at all, and for other programs."""

from reojax._internal.files import (
    check_ending as check_ending,
    check_writable as check_writable,
    replacing as replacing,
    write_json as write_json,
)
