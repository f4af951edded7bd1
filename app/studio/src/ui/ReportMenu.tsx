import { Button } from "./Button";
import { Menu } from "./Menu";
import type { ReportFormat } from "../store/report";
import { trying } from "../store/trouble";

/** Writes a report, as a page or to print. */
export function ReportMenu({
  write,
  id = "report",
}: {
  write: (format: ReportFormat) => Promise<void>;
  id?: string;
}) {
  return (
    <Menu label="Report" icon="file" id={id}>
      <Button kind="quiet" onClick={trying(() => write("pdf"))}>
        PDF, to print and send
      </Button>
      <Button kind="quiet" onClick={trying(() => write("html"))}>
        Page (HTML), with all data
      </Button>
    </Menu>
  );
}
