#!/bin/sh
# Copies the database of a service, which may run during the copy. The copy has every change that was acknowledged
# before it began.
#   backup.sh sqlite:////var/lib/joulepath/joulepath.db /backup/joulepath.db
#   backup.sh postgresql://joulepath:PASSWORD@host/joulepath /backup/joulepath.dump
set -eu
url=$1 file=$2

umask 077
part=$file.part
rm -f "$part"
case $url in
sqlite:///*)
    # VACUUM INTO reads in one transaction, so the copy has no partial change, unlike a copy of the file
    python3 -c '
import os, pathlib, sqlite3, sys
source, target = sys.argv[1:]
connection = sqlite3.connect(pathlib.Path(source).absolute().as_uri() + "?mode=rw", uri=True, timeout=60)
connection.execute("VACUUM INTO ?", (target,))
copy = os.open(target, os.O_RDONLY)
os.fsync(copy)
' "${url#sqlite:///}" "$part"
    ;;
postgresql://*)
    pg_dump --format=custom --file="$part" "$url"
    ;;
*)
    echo "$url: give the value of JOULEPATH_DATABASE_URL, sqlite:///… or postgresql://…" >&2
    exit 2
    ;;
esac
# the backup appears only when it is complete
mv "$part" "$file"
