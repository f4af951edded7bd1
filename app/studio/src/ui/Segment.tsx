interface Props<T extends string> {
  label: string;
  options: readonly { value: T; text: string; disabled?: string }[];
  value: T;
  onChange: (value: T) => void;
}

/** One of a few choices, side by side; arrow keys move between them. */
export function Segment<T extends string>({ label, options, value, onChange }: Props<T>) {
  const onKeyDown = (event: KeyboardEvent) => {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!step) return;
    event.preventDefault();
    const all = [
      ...(event.currentTarget as HTMLElement).querySelectorAll<HTMLButtonElement>("button:enabled"),
    ];
    const next =
      all[
        (all.indexOf(document.activeElement as HTMLButtonElement) + step + all.length) % all.length
      ];
    next?.focus();
    next?.click();
  };
  return (
    <div class="segment" role="radiogroup" aria-label={label} onKeyDown={onKeyDown}>
      {options.map((option) => (
        <button
          type="button"
          role="radio"
          key={option.value}
          aria-checked={option.value === value}
          tabIndex={option.value === value ? 0 : -1}
          disabled={Boolean(option.disabled)}
          title={option.disabled}
          onClick={() => onChange(option.value)}
        >
          {option.text}
        </button>
      ))}
    </div>
  );
}
