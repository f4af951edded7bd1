import { Button } from "./Button";
import { Menu } from "./Menu";
import type { ReportFormat } from "../store/report";
import { trying } from "../store/trouble";

/** Writes a report, as a page or to print. */
export function ReportMenu({ write }: { write: (format: ReportFormat) => Promise<void> }) {
  return (
    <Menu label="Report" icon="file" id="report">
      <Button kind="quiet" onClick={trying(() => write("pdf"))}>
        PDF, to print and send
      </Button>
      <Button kind="quiet" onClick={trying(() => write("html"))}>
        Page (HTML), with all data
      </Button>
    </Menu>
  );
}
