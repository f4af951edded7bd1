import type { ComponentChildren } from "preact";
import { figure } from "../store/units";

export type CellValue = ComponentChildren | number | null;

interface Props {
  head: ComponentChildren[];
  rows: { key?: string | number; class?: string; title?: string; cells: CellValue[] }[];
  label: string;
}

/** A table of words and numbers; a null is a number that is not known. */
export function Table({ head, rows, label }: Props) {
  const isNumber = (column: number) => rows.some(({ cells }) => typeof cells[column] === "number");
  return (
    <div class="scroll" role="region" aria-label={label} tabIndex={0}>
      <table>
        <thead>
          <tr>
            {head.map((name, k) =>
              name ? (
                <th key={k} class={isNumber(k) ? "number" : undefined} scope="col">
                  {name}
                </th>
              ) : (
                <td key={k} />
              ),
            )}
          </tr>
        </thead>
        <tbody>
          {rows.map(({ key, cells, ...row }, k) => (
            <tr key={key ?? k} {...row}>
              {cells.map((cell, column) => (
                <td key={column} class={isNumber(column) ? "number" : undefined}>
                  {cell === null || typeof cell === "number" ? figure(cell) : cell}
                </td>
              ))}
            </tr>
          ))}
        </tbody>
      </table>
    </div>
  );
}
